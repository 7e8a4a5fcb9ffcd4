// How near levels are to trees that other software made: the table of README, "How near".
//
//   node tests/bench/trees.mjs PLEACH TREE.glb... -o DIR [--preset P]
//
// Bakes each tree at 10 %, 3 %, 1 % and 24 triangles and measures what was written, from views that levels were not
// fitted to: supersampled, and as a client draws it (mips, alpha test, multisampling). DIR gets the packages and
// trees.md, which grows with every tree.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { parseArgs } from 'node:util';

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: { out: { type: 'string', short: 'o' }, preset: { type: 'string', default: 'balanced' } },
});
const [pleach, ...trees] = positionals;
if (trees.length === 0 || !options.out) {
  console.error('usage: node trees.mjs PLEACH TREE.glb... -o DIR [--preset draft|balanced|best]');
  process.exit(2);
}

/** Where levels of 10 %, 3 % and 1 % start, pixels of height; the last level is for 64. */
const STARTS = [512, 362, 256];
const COMPARED = 256;
const LAST = 64;
const VIEWS = ['--azimuth-offset', '11', '--views', '16', '--elevations', '0,30,-15', '--silhouettes', '--client', '--json'];

const run = (...args) => JSON.parse(execFileSync(pleach, args, { encoding: 'utf8', maxBuffer: 1 << 28, stdio: ['ignore', 'pipe', 'inherit'] }));
const sizeOf = (level, px) => level.sizes.find((s) => s.height_px === px);
const f = (x, digits = 3) => x.toFixed(digits).replace(/^0\./, '.');
const range = (values) => `${Math.min(...values).toFixed(2)}-${Math.max(...values).toFixed(2)}`;

function row(tree) {
  const name = basename(tree).replace(/\.gl(b|tf)$/, '');
  const folder = join(options.out, name);
  const baked = run('bake', tree, '-o', folder, '--triangles', '10%,3%,1%,24', '--preset', options.preset, '--accept', '--force', '--json');
  const file = (level) => join(folder, `${name}_LOD${level}.glb`);
  const near = run('evaluate', tree, ...STARTS.map((px, i) => `${file(i + 1)}@${px}`), '--height', String(COMPARED), ...VIEWS);
  const far = run('evaluate', tree, `${file(4)}@${LAST}`, '--height', String(LAST), ...VIEWS);
  const levels = [...near.levels, ...far.levels];
  const compared = levels.map((level, i) => sizeOf(level, i < 3 ? COMPARED : LAST));
  // Each level where it starts and at twice that distance.
  const own = levels.flatMap((level, i) => {
    const start = [...STARTS, LAST][i];
    return [start, start / 2].map((px) => sizeOf(level, px));
  });
  const original = new Map([...near.original.sizes, ...far.original.sizes].map((s) => [s.height_px, s.client?.f1.mean]));
  // What the client costs the level, what so few samples cost it without mips, and what the client costs the original
  // itself, from where it costs the level most.
  const [loss, few, ofOriginal] = own
    .map((s) => {
      const lost = (f1) => s.f1.mean - f1.mean;
      return [lost(s.client.f1), s.client.sampled.map((few) => lost(few.f1)), 1 - original.get(s.height_px)];
    })
    .reduce((most, each) => (each[0] > most[0] ? each : most));
  const above = own.filter((s) => s.client.f1.mean > original.get(s.height_px)).length;
  const cells = [
    name,
    baked.original.triangles.toLocaleString('en'),
    ...compared.map((s) => `${f(s.f1.mean)} (${s.shift_ratio.toFixed(2)})`),
    range(compared.map((s) => s.area_ratio.mean)),
    range(own.map((s) => s.client.area_ratio.mean)),
    f(loss),
    few.map((lost) => f(lost)).join(' / '),
    f(ofOriginal),
    `${above}/${own.length}`,
    `${baked.bake.seconds.toFixed(0)} s`,
  ];
  return { text: `| ${cells.join(' | ')} |`, e: compared.map((s) => s.shift_ratio), worst: compared.map((s) => (1 - s.f1.worst) / (1 - s.f1.mean)) };
}

mkdirSync(options.out, { recursive: true });
const table = join(options.out, 'trees.md');
const head = ['| tree | triangles | 10 % | 3 % | 1 % | 24 | area | area, client | F1 lost in client | with 4 samples / 1 alone | by the original | above the original | time |', '|---|---|---|---|---|---|---|---|---|---|---|---|---|'];
const lines = existsSync(table) ? readFileSync(table, 'utf8').trim().split('\n').filter((l) => l.startsWith('|')) : head;
const all = [];
for (const tree of trees) {
  const made = row(tree);
  lines.push(made.text);
  all.push(made);
  writeFileSync(table, lines.join('\n') + '\n');
  console.log(made.text, `worst view over mean error: ${made.worst.map((w) => w.toFixed(2)).join(' ')}`);
}
const mean = (k) => all.reduce((sum, m) => sum + m.e[k], 0) / all.length;
const most = (k) => Math.max(...all.map((m) => m.e[k]));
console.log(`E, mean over these trees (worst): ${[0, 1, 2, 3].map((k) => `${mean(k).toFixed(2)} (${most(k).toFixed(2)})`).join(', ')}`);
