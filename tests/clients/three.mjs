// three.js in headless Chromium draws an original and its levels as a page shows them, and measures them against the
// supersampled original.
//
//   node three.mjs ORIGINAL.glb [LEVEL.glb[@HEIGHT[,HEIGHT...]]]... [--package DIR] [-o DIR] [--height PX,...]
//                  [--views A/E,...] [--around N] [--offset DEGREES] [--focal PX] [--supersampled] [--targets]
//                  [--agree REPORT.json]
//
// HEIGHT is the tree's height in pixels (default 256). --package adds all levels of a bake, each where its report.json
// measured it, its own height, and at half of that, which is twice the distance.
// --focal is the lens, as the focal length in pixels: the eye is where the tree takes its height through it. Default is that
// of the report that --agree names, else 1080 lines and 60 degrees (935.3); 0 is for parallel rays.
// --agree holds our own raster to three.js: REPORT.json is what `pleach evaluate --client -o` wrote of the same files at
// the same heights and views (`--views 3N+1 --elevations 0,30,-15 --azimuth-offset DEGREES` for `--around N --offset
// DEGREES`); precision and recall have to agree within 0.02, mean base colours, drawn without light, within 2 % of their
// brightest channel.
// The original is drawn supersampled too, the levels only with --supersampled. Fails if a level is empty from any side,
// upside down, or of another colour; with --targets also if it misses what the README promises. Prints one JSON object;
// with DIR it is written there instead, as three.json, beside a sheet of pictures for each height.
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { parseArgs } from 'node:util';
import { withPage } from './browser.mjs';
import { meanLight, summarise } from './measures.mjs';
import { parseViews, views as defaultViews } from './views.mjs';

/** A level covers at least this share of the original from every side. */
const LEAST_AREA = 0.3;
/** Distance of mean colours in sRGB, 0..255 a channel, that a level may have over all views. */
const MOST_COLOUR_ERROR = 20;
/** What the README promises: area within these bounds, F1 within this of the supersampled level. */
const TARGET_AREA = [0.95, 1.05];
const TARGET_F1_LOSS = 0.03;
/** How far our raster may be from three.js: precision and recall, and the share of a mean colour. */
const AGREE_SILHOUETTE = 0.02;
const AGREE_COLOUR = 0.02;

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    out: { type: 'string', short: 'o' },
    package: { type: 'string' },
    height: { type: 'string', default: '256' },
    views: { type: 'string' },
    around: { type: 'string', default: '5' },
    offset: { type: 'string', default: '0' },
    focal: { type: 'string' },
    supersampled: { type: 'boolean', default: false },
    targets: { type: 'boolean', default: false },
    agree: { type: 'string' },
  },
});
if (positionals.length === 0) {
  console.error('usage: node three.mjs ORIGINAL.glb [LEVEL.glb[@HEIGHT,...]]... [-o DIR]');
  process.exit(2);
}

const ours = options.agree && JSON.parse(readFileSync(options.agree, 'utf8'));
const USUAL_FOCAL = 1080 / (2 * Math.tan(Math.PI / 6));
const focal = Number(options.focal ?? (ours ? (ours.focal_px ?? 0) : USUAL_FOCAL));
const supersampled = options.supersampled || options.targets;
const numbers = (text) => text.split(',').map(Number);
const files = positionals.map((argument) => {
  const [, file, heights] = argument.match(/^(.*?)(?:@([\d.,]+))?$/);
  return { file, heights: numbers(heights ?? options.height) };
});
if (options.package) {
  const { levels } = JSON.parse(readFileSync(join(options.package, 'report.json'), 'utf8'));
  for (const { file, sizes } of levels) {
    const heights = sizes.flatMap(({ height_px }) => [height_px, Math.round(height_px / 2)]);
    files.push({ file: join(options.package, file), heights: [...new Set(heights)] });
  }
}
// The original is drawn at every height that a level asks for, at its own only where there are none.
files[0].heights = [...new Set((files.length > 1 ? files.slice(1) : files).flatMap((f) => f.heights))].sort((a, b) => b - a);
const views = options.views ? parseViews(options.views) : defaultViews(Number(options.around), Number(options.offset));
const shown = [...new Set([0, 0.23, 0.42, 0.66, 0.85, 1].map((t) => Math.round(t * (views.length - 1))))];

const report = await withPage('three.html', files.map((f) => f.file), async (page, trouble) => {
  const about = await page.evaluate('about()');
  const levels = [];
  for (const [index, { file, heights }] of files.entries()) {
    const job = { url: `/file/${index}/${encodeURIComponent(basename(file))}`, label: basename(file), modes: ['client', options.agree && 'unlit', (index === 0 || supersampled) && 'reference'].filter(Boolean), heights, views, shown, focal };
    const measured = await page.evaluate((j) => window.measureFile(j), job);
    levels.push({ file, original: index === 0, ...measured });
  }
  if (options.out) {
    mkdirSync(options.out, { recursive: true });
    for (const height of files[0].heights) {
      const url = await page.evaluate((h) => window.sheet(h), height);
      writeFileSync(join(options.out, `three_${height}.png`), Buffer.from(url.split(',')[1], 'base64'));
    }
  }
  return { client: 'three.js', ...about, trouble: [...new Set(trouble)].filter((t) => !/GPU stall/.test(t)), levels };
});

for (const level of report.levels) {
  for (const result of level.results) {
    const sideViews = result.views.filter((view) => Math.abs(view.elevation) < 60);
    for (const key of ['f1', 'precision', 'recall', 'area_ratio', 'half_area_ratio']) result[key] = summarise(result.views, key);
    result.colour_error = summarise(result.views, 'colour_error', 0);
    result.upright = sideViews.length ? summarise(sideViews, 'upright').mean : null;
  }
}

/** The figures of one file at one height. */
const find = (level, mode, height) => level.results.find((r) => r.mode === mode && r.height_px === height);

const faults = [...report.trouble];
for (const level of report.levels) {
  for (const result of level.results.filter((r) => r.mode === 'client')) {
    const where = `${basename(level.file)} at ${result.height_px} px`;
    const least = Math.min(...result.views.map((view) => view.area_ratio));
    if (!level.original && least < LEAST_AREA) faults.push(`${where}: covers ${least.toFixed(2)} of the original in one view`);
    if (level.original && result.views.some((view) => view.area_px === 0)) faults.push(`${where}: empty`);
    // What a client makes of the original from afar is not our fault: leaves dissolve, bark and bare mips remain.
    if (level.original) continue;
    if (result.upright !== null && result.upright < 0) faults.push(`${where}: looks more like the tree upside down`);
    if (result.colour_error.mean > MOST_COLOUR_ERROR) faults.push(`${where}: mean colour is ${result.colour_error.mean.toFixed(1)} off`);
    if (!options.targets) continue;
    const area = result.area_ratio.mean;
    if (area < TARGET_AREA[0] || area > TARGET_AREA[1]) faults.push(`${where}: covered area ${area.toFixed(3)}`);
    const own = find(level, 'reference', result.height_px).f1.mean;
    if (result.f1.mean < own - TARGET_F1_LOSS) faults.push(`${where}: F1 ${result.f1.mean.toFixed(3)}, supersampled ${own.toFixed(3)}`);
  }
}
if (ours) faults.push(...disagreements());
report.faults = faults;

/** Where our raster, as a client, is too far from three.js; says what it compared. */
function disagreements() {
  const found = [];
  let count = 0;
  for (const level of report.levels) {
    const named = [ours.original, ...ours.levels].find((l) => l.file === basename(level.file));
    for (const three of level.results.filter((r) => r.mode === 'client')) {
      const client = named?.sizes.find((s) => s.height_px === three.height_px)?.client;
      if (!client) continue;
      const where = `${basename(level.file)} at ${three.height_px} px`;
      const parts = [];
      for (const key of ['precision', 'recall']) {
        const [a, b] = [client[key].mean, three[key].mean];
        parts.push(`${key} ${a.toFixed(4)} / ${b.toFixed(4)}`);
        if (!(Math.abs(a - b) <= AGREE_SILHOUETTE)) found.push(`${where}: ${key} ${a.toFixed(3)}, three.js ${b.toFixed(3)}`);
      }
      const theirs = meanLight(find(level, 'unlit', three.height_px).views);
      const colour = client.base_color_linear ?? [];
      const most = Math.max(...theirs);
      const off = Math.max(...theirs.map((t, c) => Math.abs(t - colour[c]) / most));
      parts.push(`base colour ${(100 * off).toFixed(2)} % off`);
      if (!(off <= AGREE_COLOUR)) found.push(`${where}: base colour ${colour.map((c) => c.toFixed(4))}, three.js ${theirs.map((c) => c.toFixed(4))}`);
      console.error(`agree: ${where}: ${parts.join(', ')}`);
      count += 1;
    }
  }
  if (count === 0) found.push(`${options.agree}: no file and height in common`);
  return found;
}

const fixed = (pair) => `${pair.mean.toFixed(3)} / ${pair.worst.toFixed(3)}`;
console.error(`three.js ${report.three}, ${report.samples} samples, ${views.length} views; mean / worst view`);
for (const level of report.levels) {
  for (const r of level.results) {
    console.error(
      `${basename(level.file).padEnd(32)} ${String(r.height_px).padStart(5)} px ${r.mode.padEnd(9)} F1 ${fixed(r.f1)}` +
        `  area ${fixed(r.area_ratio)}  half ${fixed(r.half_area_ratio)}  colour ${r.colour_error.mean.toFixed(1)}` +
        `${r.upright === null ? '' : `  upright ${r.upright.toFixed(2)}`}`,
    );
  }
}
for (const fault of faults) console.error(`FAIL ${fault}`);
const text = JSON.stringify(report, null, 1);
if (options.out) writeFileSync(join(options.out, 'three.json'), text);
else console.log(text);
process.exit(faults.length ? 1 : 0);
