// The checks themselves, on cases small enough to work out by hand: npm test
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { lodFaults } from './levels.mjs';
import { boxDown, compare, measure, summarise } from './measures.mjs';
import { trianglesInScene } from './glb.mjs';

/** Level 0 in the scene, two lower ones outside it; `change` breaks something. */
function chain(change = () => {}) {
  const gltf = {
    extensionsUsed: ['MSFT_lod'],
    scenes: [{ nodes: [0] }],
    nodes: [
      { children: [1], extensions: { MSFT_lod: { ids: [2, 3] } }, extras: { MSFT_screencoverage: [0.5, 0.2, 0.01] } },
      { mesh: 0 },
      { mesh: 1 },
      { mesh: 2 },
    ],
  };
  change(gltf);
  return lodFaults(gltf).join('; ');
}

test('a chain of levels as it should be has no fault', () => assert.equal(chain(), ''));

const broken = {
  'level 9 does not exist': (g) => (g.nodes[0].extensions.MSFT_lod.ids[1] = 9),
  'level 3 is drawn with the scene': (g) => g.scenes[0].nodes.push(3),
  'level 2 is empty': (g) => delete g.nodes[2].mesh,
  'a level is listed twice': (g) => (g.nodes[0].extensions.MSFT_lod.ids = [2, 2]),
  'no extras.MSFT_screencoverage': (g) => delete g.nodes[0].extras,
  '2 screen coverages for 3 levels': (g) => g.nodes[0].extras.MSFT_screencoverage.pop(),
  'screen coverages do not decrease': (g) => (g.nodes[0].extras.MSFT_screencoverage = [0.5, 0.5, 0]),
  'screen coverage outside 0..1': (g) => (g.nodes[0].extras.MSFT_screencoverage[0] = 2),
  'MSFT_lod is not in extensionsUsed': (g) => delete g.extensionsUsed,
  'has levels but is in no scene': (g) => (g.scenes[0].nodes = [1]),
};
for (const [message, change] of Object.entries(broken)) {
  test(`found: ${message}`, () => assert.match(chain(change), new RegExp(message)));
}

test('nodes that share a mesh are counted each, lower levels are not', () => {
  const gltf = {
    scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { mesh: 0 }, { mesh: 0 }],
    meshes: [{ primitives: [{ indices: 0, attributes: { POSITION: 1 } }, { attributes: { POSITION: 1 } }] }],
    accessors: [{ count: 12 }, { count: 3 }],
  };
  assert.equal(trianglesInScene(gltf), 10);
});

/** A picture from rows of coverage in quarters; colour is red. */
function picture(...rows) {
  const alpha = rows.flat().map((quarters) => Math.round((quarters * 255) / 4));
  return { width: rows[0].length, height: rows.length, rgba: alpha.flatMap((a) => [a, 0, 0, a]) };
}

test('four samples become one pixel', () => {
  const small = boxDown(picture([4, 4, 0, 0], [0, 4, 0, 4]), 2);
  assert.deepEqual([...small.rgba].filter((_, i) => i % 4 === 3), [191, 64]);
});

test('precision, recall and F1 count covered pixels', () => {
  // Three covered, four wanted, two in common.
  const figures = compare(measure(picture([4, 4, 4, 0, 0])), measure(picture([0, 4, 4, 4, 4])));
  assert.equal(figures.precision, 2 / 3);
  assert.equal(figures.recall, 2 / 4);
  assert.equal(figures.f1, (2 * 2) / (3 + 4));
  assert.equal(figures.half_area_ratio, 3 / 4);
  assert.equal(figures.area_ratio, 3 / 4);
});

test('half a pixel counts as covered, less does not, and coverage sums both', () => {
  const { area, coverage, colour } = measure(picture([2, 1, 4]));
  assert.equal(area, 2);
  assert.ok(Math.abs(coverage - 1.75) < 0.01);
  assert.ok(Math.abs(colour[0] - 255) < 0.01);
});

test('a tree upside down is nearer to the reference upside down', () => {
  const crown = [[4, 4, 4], [4, 4, 4], [0, 4, 0]];
  const tree = measure(picture(...crown));
  assert.ok(compare(tree, tree).upright > 0.1);
  assert.ok(compare(measure(picture(...crown.reverse())), tree).upright < -0.1);
});

test('an empty picture has an F1 of zero, not none', () => {
  const empty = measure(picture([0, 0]));
  assert.equal(compare(empty, measure(picture([4, 4]))).f1, 0);
});

test('the worst view is the one furthest from the ideal, above or below it', () => {
  assert.deepEqual(summarise([{ a: 0.9 }, { a: 1.3 }], 'a'), { mean: 1.1, worst: 1.3 });
});
