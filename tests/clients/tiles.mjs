// Lets engines that read 3D Tiles look at a package's hierarchy, from near to far.
//
//   node tiles.mjs PACKAGE [-o DIR]
//
// Fails unless NASA's 3d-tiles-renderer and Cesium show geometry from near, fewer and coarser tiles the farther they are,
// the whole tree's billboards alone from where the manifest says, and nothing only where the tileset says so; and unless
// the tree covers what its level 0 covers. With DIR, pictures are written there.
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { withPage } from './browser.mjs';

const { values: options, positionals } = parseArgs({ allowPositionals: true, options: { out: { type: 'string', short: 'o' } } });
if (positionals.length !== 1) {
  console.error('usage: node tiles.mjs PACKAGE [-o DIR]');
  process.exit(2);
}
const folder = resolve(positionals[0]);
const [set] = readdirSync(folder).filter((name) => name.endsWith('_tileset.json'));
if (!set) {
  console.error(`${folder} holds no tileset: bake with --hierarchy`);
  process.exit(2);
}
if (options.out) mkdirSync(options.out, { recursive: true });
const name = set.replace('_tileset.json', '');
const tileset = JSON.parse(readFileSync(join(folder, set)));
// The root has no content: nothing is drawn where its error is small enough.
const [root] = tileset.root.children;
const [x, minusZ, y, radius] = root.boundingVolume.sphere;
const middle = [x, y, -minusZ];

// Both clients' defaults: an error of 16 pixels; this page has 256 lines and 60 degrees.
const focal = 256 / (2 * Math.tan(Math.PI / 6));
const until = (error) => radius + (error * focal) / 16;
const [whole, gone] = [root, tileset].map((tile) => until(tile.geometricError));
const near = 1.4 * radius;
const distances = [near, Math.sqrt(near * whole), 1.05 * whole, 0.5 * (whole + Math.min(gone, 4 * whole))];
if (gone < 1e6) distances.push(1.05 * gone);

const faults = [];
const check = (holds, what) => holds || faults.push(what);

/** What both engines have to do. */
function judge(who, looks, original) {
  const [from, between, wholeTree, far, vanished] = looks;
  const geometry = (look) => look.shown.filter((s) => s.endsWith('_geometry.glb')).length;
  const only = [root.content.uri];
  check(geometry(from) > 0, `${who}: no geometry at ${from.distance.toFixed(1)} m`);
  check(between.shown.length > 1 && between.shown.join() !== from.shown.join(), `${who}: does not coarsen at ${between.distance.toFixed(1)} m`);
  check(geometry(between) < geometry(from), `${who}: as much geometry from afar`);
  for (const look of [wholeTree, far]) {
    check(look.shown.join() === only.join(), `${who}: ${look.shown.length} tiles at ${look.distance.toFixed(1)} m, not the whole tree`);
    check(look.covered > 0, `${who}: nothing to see at ${look.distance.toFixed(1)} m`);
  }
  if (vanished) check(vanished.shown.length === 0 && vanished.covered === 0, `${who}: still there at ${vanished.distance.toFixed(1)} m`);
  // Cesium's canvas says of every pixel that a triangle touches that it is covered.
  for (const [i, look] of who === 'nasa' ? looks.slice(0, 3).entries() : []) {
    const share = look.covered / original[i].covered;
    check(share > 0.75 && share < 1.3, `${who}: covers ${share.toFixed(2)} of the original at ${look.distance.toFixed(1)} m`);
  }
}

await withPage(
  'tiles.html',
  [],
  async (page, trouble) => {
    const look = (what, url) => page.evaluate(([what, ...rest]) => window[what](...rest), [what, url, middle, distances]);
    const original = await look('whole', `/package/${name}_LOD0.glb`);
    for (const who of ['nasa', 'cesium']) {
      const looks = await look(who, `/package/${set}`);
      judge(who, looks, original);
      for (const [i, { distance, shown, triangles, covered, picture }] of looks.entries()) {
        const cost = triangles === undefined ? '' : `, ${triangles} triangles of ${original[i].triangles}`;
        console.log(`${who} at ${distance.toFixed(1)} m: ${shown.length} tiles${cost}, ${covered} pixels, original ${original[i].covered}`);
        if (options.out) writeFileSync(join(options.out, `${who}_${i}.png`), Buffer.from(picture.split(',')[1], 'base64'));
      }
    }
    if (options.out) original.forEach(({ picture }, i) => writeFileSync(join(options.out, `original_${i}.png`), Buffer.from(picture.split(',')[1], 'base64')));
    const told = trouble.filter((t) => !/versions at 1.1 or higher have limited support/.test(t));
    check(told.length === 0, `the page says: ${told.slice(0, 3).join('; ')}`);
  },
  folder,
);
for (const fault of faults) console.log(`FAIL ${fault}`);
process.exit(faults.length ? 1 : 0);
