// What the extension MSFT_lod and its screen coverages ask for, which the official validator does not look at.
import { reachable } from './glb.mjs';

/** Everything wrong in the level chains of a file. */
export function lodFaults(gltf) {
  const faults = [];
  // A species has a scene for each tree.
  const drawn = reachable(gltf, (gltf.scenes ?? []).flatMap((scene) => scene.nodes ?? []));
  (gltf.nodes ?? []).forEach((node, index) => {
    const ids = node.extensions?.MSFT_lod?.ids;
    if (!ids) return;
    if (!gltf.extensionsUsed?.includes('MSFT_lod')) faults.push('MSFT_lod is not in extensionsUsed');
    if (!drawn.has(index)) faults.push(`node ${index} has levels but is in no scene`);
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
