// The tables of others.mjs.

const HEAD = '| compared with | method | triangles | texture MB | time | F1 mean | F1 worst | area |\n|---|---|---|---|---|---|---|---|\n';
const GROUPS = ['10 %', '3 %', '1 %', '48 triangles', '8 triangles', '6 triangles'];

const f1 = (value) => value.toFixed(3).replace(/^0/, '');
const mega = (bytes) => (bytes / 2 ** 20).toFixed(1);
const time = (ratio) => ratio.toPrecision(2);
const line = (cells) => `| ${cells.join(' | ')} |\n`;

/** All rows of one tree, each under our level that it is compared with. */
export function table({ tree, triangles, rows }) {
  const row = (r) =>
    line([r.label === 'pleach' ? r.group : '', r.label, r.triangles, mega(r.texture_bytes), time(r.time_ratio), f1(r.f1.mean), f1(r.f1.worst), r.area_ratio.mean.toFixed(2)]);
  const order = (r) => 2 * GROUPS.indexOf(r.group) + (r.label === 'pleach' ? 0 : 1);
  const sorted = [...rows].sort((a, b) => order(a) - order(b));
  return `**${tree}**, ${triangles} triangles\n\n${HEAD}${sorted.map(row).join('')}`;
}

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;
const geometric = (values) => Math.exp(mean(values.map(Math.log)));

/** Means over trees, and how often ours is nearer. Time: geometric mean of ratios to our level; textures: all trees' over ours. */
export function summary(found) {
  const ours = ({ rows }, group) => rows.find((r) => r.label === 'pleach' && r.group === group);
  const labels = [...new Set(found.flatMap(({ rows }) => rows.filter((r) => r.label !== 'pleach').map(key)))];
  let out = `Means over ${found.length} trees; time (geometric mean) and texture bytes (of all trees) over those of our level\n\n`;
  out += '| method | beside ours | textures | time | F1 mean | ours | F1 worst | ours | area | ours | we are nearer |\n';
  out += '|---|---|---|---|---|---|---|---|---|---|---|\n';
  for (const label of labels) {
    const pairs = found.flatMap((f) => f.rows.filter((r) => key(r) === label).map((r) => [r, ours(f, r.group)]));
    const groups = new Set(pairs.map(([r]) => r.group));
    const of = (value) => [0, 1].map((i) => mean(pairs.map((p) => value(p[i]))));
    const [theirs, our] = of((r) => r.f1.mean).map(f1);
    const [worst, ourWorst] = of((r) => r.f1.worst).map(f1);
    const [area, ourArea] = of((r) => r.area_ratio.mean).map((a) => a.toFixed(2));
    const [bytes, ourBytes] = of((r) => r.texture_bytes);
    const won = pairs.filter(([r, o]) => o.f1.mean > r.f1.mean).length;
    out += line([
      pairs[0][0].label,
      groups.size === 1 ? [...groups][0] : 'nearest bytes',
      time(bytes / ourBytes),
      time(geometric(pairs.map(([r]) => r.time_ratio))),
      theirs,
      our,
      worst,
      ourWorst,
      area,
      ourArea,
      `${won} of ${pairs.length}`,
    ]);
  }
  return out;
}

/** What rows of different trees have in common. */
const key = (r) => (/^(gltfpack|Blender)/.test(r.label) ? `${r.label} ${r.group}` : r.label);
