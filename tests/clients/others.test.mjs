// The tables of tests/bench/others.mjs, from figures that are easy to check by hand.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { summary, table } from '../bench/others-table.mjs';

const row = (label, group, f1, time_ratio, more = {}) => ({
  label,
  group,
  triangles: 48,
  texture_bytes: 2 ** 21,
  time_ratio,
  f1: { mean: f1, worst: f1 - 0.1 },
  area_ratio: { mean: 1 },
  ...more,
});
const trees = [
  { tree: 'oak', triangles: 1000, rows: [row('pleach', '48 triangles', 0.9, 1), row('Décoret', '48 triangles', 0.8, 0.5)] },
  { tree: 'fir', triangles: 2000, rows: [row('pleach', '48 triangles', 0.7, 1), row('Décoret', '48 triangles', 0.8, 2, { texture_bytes: 0 })] },
];

test('the summary has means over trees, and says where another is nearer', () => {
  const line = summary(trees).split('\n').find((l) => l.includes('Décoret'));
  const cells = line.split('|').map((c) => c.trim()).slice(1, -1);
  assert.deepEqual(cells, ['Décoret', '48 triangles', '0.50', '1.0', '.800', '.800', '.700', '.700', '1.00', '1.00', '1 of 2']);
});

test('a row that stands beside different levels of different trees says so', () => {
  const moved = structuredClone(trees);
  moved[1].rows.push(row('pleach', '1 %', 0.75, 1));
  moved[1].rows[1].group = '1 %';
  const line = summary(moved).split('\n').find((l) => l.includes('Décoret'));
  assert.ok(line.includes('| nearest bytes |'), line);
});

test("a tree's table has our level before those that it is compared with", () => {
  const rows = [...trees[0].rows].reverse();
  const lines = table({ ...trees[0], rows }).split('\n').filter((l) => l.startsWith('| 48') || l.startsWith('|  |'));
  assert.deepEqual(lines.map((l) => l.split('|')[2].trim()), ['pleach', 'Décoret']);
});
