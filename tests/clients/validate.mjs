// The official glTF validator over all files given: no error, no warning. What it can't know is checked here:
// it looks into neither MSFT_lod nor extras, and which extensions clients lack is no fault by the specification.
//
//   node validate.mjs FILE.glb...
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';
import validator from 'gltf-validator';
import { readGlbJson, reachable, sceneRoots, trianglesInScene } from './glb.mjs';

/** Files that hold one level, for clients that know no extension at all. */
const SINGLE_LEVEL = /_LOD\d+\.glb$/;

/** Everything wrong in the level chains of a file (extension MSFT_lod). */
function lodFaults(gltf) {
  const faults = [];
  const drawn = reachable(gltf, sceneRoots(gltf));
  (gltf.nodes ?? []).forEach((node, index) => {
    const ids = node.extensions?.MSFT_lod?.ids;
    if (!ids) return;
    if (!gltf.extensionsUsed?.includes('MSFT_lod')) faults.push('MSFT_lod is not in extensionsUsed');
    if (!drawn.has(index)) faults.push(`node ${index} has levels but is not in the scene`);
    if (ids.length === 0) faults.push(`node ${index}: no levels`);
    if (new Set(ids).size !== ids.length) faults.push(`node ${index}: a level is listed twice`);
    for (const id of ids) {
      if (!gltf.nodes[id]) {
        faults.push(`node ${index}: level ${id} does not exist`);
        continue;
      }
      const level = reachable(gltf, [id]);
      if ([...level].some((n) => drawn.has(n))) faults.push(`node ${index}: level ${id} is drawn with the scene`);
      if (![...level].some((n) => gltf.nodes[n].mesh !== undefined)) faults.push(`node ${index}: level ${id} is empty`);
    }
    faults.push(...coverageFaults(node.extras?.MSFT_screencoverage, ids.length + 1).map((f) => `node ${index}: ${f}`));
  });
  return faults;
}

/** One number for each level, level 0 included, each smaller than the one before, in [0, 1]. */
function coverageFaults(coverage, levels) {
  if (!Array.isArray(coverage)) return ['no extras.MSFT_screencoverage'];
  const faults = [];
  if (coverage.length !== levels) faults.push(`${coverage.length} screen coverages for ${levels} levels`);
  if (coverage.some((c) => typeof c !== 'number' || !(c >= 0 && c <= 1))) faults.push('screen coverage outside 0..1');
  if (coverage.some((c, i) => i > 0 && !(c < coverage[i - 1]))) faults.push('screen coverages do not decrease');
  return faults;
}

/** What makes clients refuse a file, or show less than all of it. */
function portabilityFaults(gltf, file) {
  const faults = [];
  if (SINGLE_LEVEL.test(file)) {
    if (gltf.extensionsRequired?.length) faults.push(`needs ${gltf.extensionsRequired}`);
    if (gltf.extensionsUsed?.includes('MSFT_lod')) faults.push('a single level refers to other levels');
  }
  const external = [...(gltf.buffers ?? []), ...(gltf.images ?? [])].filter((part) => part.uri !== undefined);
  if (external.length) faults.push(`${external.length} buffers or images outside the file`);
  if (!(trianglesInScene(gltf) > 0)) faults.push('the scene has no triangles');
  return faults;
}

/** All faults of one file, and the codes of the validator's infos. */
async function check(file) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 0 });
  const serious = report.issues.messages.filter((m) => m.severity < 2);
  const shown = serious.slice(0, 10).map((m) => `${m.code} at ${m.pointer}: ${m.message}`);
  if (serious.length > shown.length) shown.push(`and ${serious.length - shown.length} more`);
  const gltf = readGlbJson(file);
  const infos = {};
  for (const m of report.issues.messages) if (m.severity >= 2) infos[m.code] = (infos[m.code] ?? 0) + 1;
  return { faults: [...shown, ...lodFaults(gltf), ...portabilityFaults(gltf, file)], infos, gltf };
}

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node validate.mjs FILE.glb...');
  process.exit(2);
}
let failed = 0;
for (const file of files) {
  const { faults, infos, gltf } = await check(file);
  const notes = Object.entries(infos).map(([code, count]) => `${code} x${count}`).join(', ');
  console.log(`${faults.length ? 'FAIL' : 'ok  '} ${basename(file)}: ${trianglesInScene(gltf)} triangles${notes && `; infos: ${notes}`}`);
  for (const fault of faults) console.log(`     ${fault}`);
  failed += faults.length > 0;
}
console.log(`validator ${validator.version()}: ${files.length - failed} of ${files.length} files clean`);
process.exit(failed ? 1 : 0);
