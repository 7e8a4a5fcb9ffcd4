// The official glTF validator over all files given: no error, no warning. What it can't know is checked here:
// it looks into neither MSFT_lod nor extras, and which extensions clients lack is no fault by the specification.
//
//   node validate.mjs [--linked] FILE.glb...
//
// --linked: images are files beside, as those of a species are: they have to be there, and the validator reads them.
import { readFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import validator from 'gltf-validator';
import { readGlbJson, trianglesInScene } from './glb.mjs';
import { lodFaults } from './levels.mjs';

const linked = process.argv.includes('--linked');

/** Files that hold one level, for clients that know no extension at all. */
const SINGLE_LEVEL = /_LOD\d+\.glb$/;

/** What makes clients refuse a file, or show less than all of it. */
function portabilityFaults(gltf, file) {
  const faults = [];
  if (SINGLE_LEVEL.test(file)) {
    if (gltf.extensionsRequired?.length) faults.push(`needs ${gltf.extensionsRequired}`);
    if (gltf.extensionsUsed?.includes('MSFT_lod')) faults.push('a single level refers to other levels');
  }
  const external = [...(gltf.buffers ?? []), ...(gltf.images ?? [])].filter((part) => part.uri !== undefined);
  if (external.length && !linked) faults.push(`${external.length} buffers or images outside the file`);
  if (!(trianglesInScene(gltf) > 0)) faults.push('the scene has no triangles');
  return faults;
}

/** All faults of one file, and the codes of the validator's infos. */
async function check(file) {
  const beside = (uri) => readFileSync(join(dirname(file), decodeURIComponent(uri)));
  const externalResourceFunction = async (uri) => new Uint8Array(beside(uri));
  const options = { maxIssues: 0, ...(linked && { externalResourceFunction }) };
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), options);
  const serious = report.issues.messages.filter((m) => m.severity < 2);
  const shown = serious.slice(0, 10).map((m) => `${m.code} at ${m.pointer}: ${m.message}`);
  if (serious.length > shown.length) shown.push(`and ${serious.length - shown.length} more`);
  const gltf = readGlbJson(file);
  const infos = {};
  for (const m of report.issues.messages) if (m.severity >= 2) infos[m.code] = (infos[m.code] ?? 0) + 1;
  return { faults: [...shown, ...lodFaults(gltf), ...portabilityFaults(gltf, file)], infos, gltf };
}

const files = process.argv.slice(2).filter((argument) => argument !== '--linked');
if (files.length === 0) {
  console.error('usage: node validate.mjs [--linked] FILE.glb...');
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
