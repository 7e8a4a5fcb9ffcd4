// Levels against what people use today, at equal triangles, all measured by the same program (`pleach evaluate`).
//
//   node baselines.mjs PLEACH ORIGINAL.glb LEVEL.glb... -o DIR [--height PX] [--also LABEL=FILE.glb]...
//
// PLEACH is the program. For every level gltfpack makes two files of as many triangles, by `-si R -se 1` and by
// `-si R -sa`; crossed quads and others come in by --also. DIR gets the files, baselines.json and baselines.md.
// Fails if a level's mean F1 is not above that of every baseline of its own triangles.
import { execFileSync } from 'node:child_process';
import { mkdirSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { parseArgs } from 'node:util';
import { METHODS, NEAR_ENOUGH, simplified, triangles } from './gltfpack.mjs';

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    out: { type: 'string', short: 'o' },
    height: { type: 'string', default: '256' },
    also: { type: 'string', multiple: true, default: [] },
  },
});
const [pleach, original, ...levels] = positionals;
if (levels.length === 0 || !options.out) {
  console.error('usage: node baselines.mjs PLEACH ORIGINAL.glb LEVEL.glb... -o DIR');
  process.exit(2);
}

mkdirSync(options.out, { recursive: true });
/** What is to be measured: for each level itself, then its baselines. */
const entries = [];
levels.forEach((file, index) => {
  const wanted = triangles(file);
  entries.push({ group: index, label: 'pleach', file });
  for (const [label, flags] of Object.entries(METHODS)) {
    const made = join(options.out, `${basename(original, '.glb')}_${index}_${label.replace(/\W+/g, '_')}.glb`);
    simplified(original, wanted, flags, made);
    entries.push({ group: index, label, file: made });
  }
});
for (const pair of options.also) {
  const cut = pair.indexOf('=');
  entries.push({ group: null, label: pair.slice(0, cut), file: pair.slice(cut + 1) });
}

const evaluated = JSON.parse(
  execFileSync(
    pleach,
    ['evaluate', original, ...entries.map((e) => e.file), '-o', join(options.out, 'evaluate'), '--json', '--height', options.height],
    { encoding: 'utf8', maxBuffer: 1 << 28, stdio: ['ignore', 'pipe', 'inherit'] },
  ),
);
for (const entry of entries) {
  const level = evaluated.levels.find((l) => basename(l.file) === basename(entry.file));
  const size = level?.sizes.find((s) => s.height_px === Number(options.height));
  if (!size) throw new Error(`evaluate says nothing about ${entry.file} at ${options.height} px`);
  Object.assign(entry, { triangles: level.triangles, f1: size.f1, shift_ratio: size.shift_ratio, area_ratio: size.area_ratio });
}

const rows = entries.map(
  (e) => `| ${e.label} | ${e.triangles} | ${e.f1.mean.toFixed(3)} | ${e.f1.worst.toFixed(3)} | ${e.shift_ratio.toFixed(2)} | ${e.area_ratio.mean.toFixed(2)} |`,
);
const table = [
  `${basename(original, '.glb')}, ${triangles(original)} triangles, ${options.height} pixels high`,
  '',
  '| method | triangles | F1 mean | F1 worst view | shift ratio | area |',
  '|---|---|---|---|---|---|',
  ...rows,
  '',
].join('\n');
writeFileSync(join(options.out, 'baselines.md'), table);
writeFileSync(join(options.out, 'baselines.json'), JSON.stringify({ original, height_px: Number(options.height), entries }, null, 1));
console.log(table);

/** A baseline counts against the levels that have at least its triangles. */
const beaten = (level, other) => other.triangles > level.triangles * (1 + 2 * NEAR_ENOUGH) || level.f1.mean > other.f1.mean;
const faults = entries
  .filter((e) => e.label === 'pleach')
  .flatMap((level) =>
    entries
      .filter((e) => e.label !== 'pleach' && (e.group === level.group || e.group === null) && !beaten(level, e))
      .map((e) => `${basename(level.file)}: F1 ${level.f1.mean.toFixed(3)}, ${e.label} has ${e.f1.mean.toFixed(3)}`),
  );
for (const fault of faults) console.error(`FAIL ${fault}`);
process.exit(faults.length ? 1 : 0);
