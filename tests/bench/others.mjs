// pleach against what others make of the same trees, in one run and by one ruler.
//
//   cargo build --release --bin pleach --example others && npm ci --prefix tests/clients
//   node tests/bench/others.mjs target/release/pleach TREE.glb... -o DIR [--bakers FILE]
//
// Every level is for trees 256 pixels high and judged there, from 16 views (the top included) that no level was fitted
// to. Equal triangles: gltfpack, Blender's decimation (where Blender is installed), Décoret's billboard cloud, crossed
// quads; equal texture bytes: impostors. What needs a baker of its own is made by `others` (tests/bench/others), beside
// PLEACH in `examples`. DIR gets all files, and others.md and others.json, written anew after each tree. A run that was
// broken off goes on where it was: what DIR has with its time (FILE.json) is not made again, so take another DIR for
// another version of anything.
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { parseArgs } from 'node:util';
import { METHODS, simplified, triangles } from '../clients/gltfpack.mjs';
import { table, summary } from './others-table.mjs';

const HEIGHT_PX = 256;
/** Our levels: what is asked for, and what they are called. */
const OURS = [['10%', '10 %'], ['3%', '3 %'], ['1%', '1 %'], ['48', '48 triangles'], ['8', '8 triangles'], ['6', '6 triangles']];
/** Of which the first are compared with gltfpack, too. */
const SIMPLIFIED = 3;
/** Triangles of crossed quads, and how many there are. Our least are six triangles. */
const QUADS = [['4', 2], ['6', 3], ['8', 4]];
/** Texels that add-ons usually take: 16 x 16 pictures of 128 x 128, 8 pictures on 2048 x 1024. */
const USUAL = { azimuths: 2048 * 1024, hemisphere: 2048 * 2048, sphere: 2048 * 2048 };
const IMPOSTORS = { azimuths: '8 views', hemisphere: 'octahedral, hemisphere', sphere: 'octahedral, sphere' };
/** RGBA with all mips, as `texture_bytes` counts. */
const BYTES_PER_TEXEL = (4 * 4) / 3;

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: { out: { type: 'string', short: 'o' }, bakers: { type: 'string' } },
});
const [pleach, ...trees] = positionals;
if (trees.length === 0 || !options.out) {
  console.error('usage: node tests/bench/others.mjs PLEACH TREE.glb... -o DIR [--bakers FILE]');
  process.exit(2);
}
const bakers = options.bakers ?? join(dirname(pleach), 'examples', 'others');

/** Whether there is a Blender to decimate with. */
const blender = !spawnSync('blender', ['--version']).error;
const DECIMATE = new URL('others/decimate.py', import.meta.url).pathname;

/** Runs a program; its output and its processor time in seconds (user and system, all threads). */
function timed(program, words) {
  const done = spawnSync('bash', ['-c', 'TIMEFORMAT="cpu %U %S"; time "$0" "$@"', program, ...words], {
    encoding: 'utf8',
    maxBuffer: 1 << 28,
  });
  const times = /cpu ([\d.]+) ([\d.]+)\s*$/.exec(done.stderr);
  if (done.status !== 0 || !times) {
    // Some tell what is wrong on their standard output.
    const told = (done.stdout + done.stderr).split('\n').filter((line) => /error/i.test(line));
    throw new Error(`${basename(program)} ${words.join(' ')}: ${told.join(' ') || done.stderr}`);
  }
  return { output: done.stdout, cpu: Number(times[1]) + Number(times[2]) };
}

/** What `make` says of how `file` was made, from an earlier run where there is one. */
function once(file, make) {
  const told = `${file}.json`;
  if (existsSync(told)) return { file, ...JSON.parse(readFileSync(told, 'utf8')) };
  const made = make();
  writeFileSync(told, JSON.stringify(made) + '\n');
  return { file, ...made };
}

/** All that is made of one tree, not judged yet; `group` is what a row is compared with. */
function made(tree, folder) {
  const name = basename(tree, '.glb');
  const scene = join(folder, 'scene.ron');
  writeFileSync(scene, `(heights_px: [${HEIGHT_PX}])`);
  const quads = join(folder, 'quads.ron');
  writeFileSync(quads, '(method: CrossedQuads)');
  const bake = (kind, count, more) => {
    const package_ = join(folder, `${kind}_${count.replace('%', 'pc')}`);
    const words = ['bake', tree, '-o', package_, '--triangles', count, '--scene', scene, '--accept', '--force', '--quiet'];
    return once(join(package_, `${name}_LOD1.glb`), () => ({ cpu: timed(pleach, [...words, ...more]).cpu }));
  };
  const rows = OURS.map(([count, group]) => ({ group, label: 'pleach', ...bake('ours', count, []) }));
  for (const { group, file } of rows.slice(0, SIMPLIFIED)) {
    for (const [label, flags] of Object.entries(METHODS)) {
      const other = join(folder, `${label}_${group}`.replace(/\W+/g, '_') + '.glb');
      // The time is that of the last run: not of the search for the ratio.
      let cpu;
      const timedRun = (program, words) => ({ cpu } = timed(program, words));
      const make = () => ({ ratio: simplified(tree, triangles(file), flags, other, timedRun), cpu });
      rows.push({ group, label, ...once(other, make) });
    }
    const decimated = join(folder, `blender_${group}`.replace(/\W+/g, '_') + '.glb');
    const script = ['--background', '--factory-startup', '--python-exit-code', '1', '--python', DECIMATE, '--'];
    const make = () => ({ cpu: timed('blender', [...script, tree, decimated, String(triangles(file))]).cpu });
    try {
      if (blender) rows.push({ group, label: 'Blender decimate', ...once(decimated, make) });
    } catch (error) {
      const why = String(error).split('\n').filter((line) => /error|extension/i.test(line));
      console.log(`skipped: Blender on ${name} at ${group} (${why.at(-1)?.trim()})`);
    }
  }
  for (const [count, quadCount] of QUADS) {
    const group = count === '8' ? '8 triangles' : '6 triangles';
    rows.push({ group, label: `${quadCount} crossed quads`, ...bake('quads', count, ['--recipe', quads]) });
  }
  const cloud = join(folder, 'decoret.glb');
  const decoret = once(cloud, () => {
    const { cpu, output } = timed(bakers, ['decoret', tree, '-o', cloud]);
    return { cpu, ...JSON.parse(output) };
  });
  rows.push({ group: '48 triangles', label: 'Décoret', ...decoret });
  return rows;
}

/** Adds the figures of every file. */
function judge(tree, rows) {
  const ruler = ['--height', HEIGHT_PX, '--views', 16, '--elevations', '0,30,-15', '--azimuth-offset', 11];
  const found = timed(pleach, ['evaluate', tree, ...rows.map((r) => r.file), ...ruler, '--silhouettes', '--json']);
  JSON.parse(found.output).levels.forEach((level, i) => {
    const size = level.sizes.find((s) => s.height_px === HEIGHT_PX);
    const { triangles, texture_bytes } = level;
    Object.assign(rows[i], { triangles, texture_bytes, f1: size.f1, area_ratio: size.area_ratio });
  });
}

/** Impostors: as many texture bytes as our 1 % have, and as many as is usual; beside our level of the nearest bytes. */
function impostors(tree, folder, rows) {
  const ours = rows.filter((r) => r.label === 'pleach');
  const equal = ours.find((r) => r.group === '1 %');
  const out = [];
  for (const [kind, label] of Object.entries(IMPOSTORS)) {
    for (const size of ['equal', 'usual']) {
      const texels = size === 'usual' ? USUAL[kind] : Math.floor(equal.texture_bytes / BYTES_PER_TEXEL);
      const page = join(folder, `${kind}_${size}.png`);
      const words = ['impostor', tree, kind, String(texels), '-o', page];
      const made = once(page, () => JSON.parse(timed(bakers, words).output));
      const [width, height] = made.page;
      const bytes = Math.round(width * height * BYTES_PER_TEXEL);
      const group = size === 'equal' ? equal.group : nearest(ours, bytes).group;
      const shown = made.shown.reduce((a, b) => (b.f1.mean > a.f1.mean ? b : a));
      out.push({
        group,
        textures: size,
        label: `${label}, ${size === 'usual' ? 'usual size' : 'equal bytes'}`,
        file: page,
        cpu: made.cpu_seconds,
        triangles: 2,
        texture_bytes: bytes,
        f1: shown.f1,
        area_ratio: shown.area_ratio,
        shown: made.shown,
      });
    }
  }
  // Décoret's page once more, beside our level whose bytes are nearest.
  const cloud = rows.find((r) => r.label === 'Décoret');
  out.push({ ...cloud, textures: 'equal', label: 'Décoret, nearest bytes', group: nearest(ours, cloud.texture_bytes).group });
  return out;
}

/** Of our levels whose bytes are nearest (within a tenth of that) the one with the fewest triangles: impostors have two. */
function nearest(ours, bytes) {
  const off = (r) => Math.abs(Math.log(r.texture_bytes / bytes));
  const least = Math.min(...ours.map(off));
  return ours.filter((r) => off(r) <= least + 0.1).reduce((a, b) => (b.triangles < a.triangles ? b : a));
}

if (!blender) console.log("skipped: Blender's decimation (there is no blender here; Debian's needs python3-numpy)");
const found = [];
for (const tree of trees) {
  const folder = join(options.out, basename(tree, '.glb'));
  mkdirSync(folder, { recursive: true });
  const rows = made(tree, folder);
  judge(tree, rows);
  rows.push(...impostors(tree, folder, rows));
  for (const row of rows) {
    const ours = rows.find((r) => r.label === 'pleach' && r.group === row.group);
    row.time_ratio = row.cpu / ours.cpu;
    row.file = row.file.slice(options.out.length).replace(/^\//, '');
  }
  found.push({ tree: basename(tree, '.glb'), triangles: triangles(tree), rows });
  const text = [summary(found), ...found.map(table)].join('\n');
  writeFileSync(join(options.out, 'others.md'), text);
  writeFileSync(join(options.out, 'others.json'), JSON.stringify({ height_px: HEIGHT_PX, trees: found }, null, 1) + '\n');
  console.log(table(found.at(-1)));
}
console.log(summary(found));
