// gltfpack as a baseline: the simplification that people reach for, at a number of triangles that is asked for.
import { execFileSync } from 'node:child_process';
import { readGlbJson, trianglesInScene } from './glb.mjs';

const PROGRAM = new URL('node_modules/gltfpack/cli.js', import.meta.url).pathname;
/** Its two ways to simplify a tree: whatever error it takes, and by merging leaves that do not touch. */
export const METHODS = { 'gltfpack -se 1': ['-se', '1'], 'gltfpack -sa': ['-sa'] };
/** It misses the ratio it is asked for: search until the count is this near. */
export const NEAR_ENOUGH = 0.01;
const MOST_TRIES = 10;

export const triangles = (file) => trianglesInScene(readGlbJson(file));

/**
 * Writes to `file` what gltfpack makes of `original` by `flags` with the number of triangles nearest to `wanted`, and
 * returns the ratio that it was asked for. `run(program, arguments)` runs it.
 */
export function simplified(original, wanted, flags, file, run = quietly) {
  const make = (ratio) => {
    run(process.execPath, [PROGRAM, '-i', original, '-o', file, '-noq', '-si', ratio.toFixed(6), ...flags]);
    return triangles(file);
  };
  let [low, high] = [0, 1];
  let ratio = Math.min(1, wanted / triangles(original));
  let best;
  for (let i = 0; i < MOST_TRIES; i++) {
    const count = make(ratio);
    const off = Math.abs(count / wanted - 1);
    if (!best || off < best.off) best = { ratio, off };
    if (off <= NEAR_ENOUGH) return ratio;
    if (count > wanted) high = ratio;
    else low = ratio;
    const next = i === 0 ? Math.min(high, Math.max(low, (ratio * wanted) / Math.max(count, 1))) : (low + high) / 2;
    ratio = next > low && next < high ? next : (low + high) / 2;
  }
  make(best.ratio);
  return best.ratio;
}

function quietly(program, words) {
  execFileSync(program, words, { stdio: ['ignore', 'ignore', 'inherit'] });
}
