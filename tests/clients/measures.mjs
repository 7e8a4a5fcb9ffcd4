// How near one picture of a tree is to another. A picture is { width, height, rgba }: rows from the top down,
// bytes, colour in sRGB multiplied by coverage, alpha the covered share of the pixel.

/** A pixel belongs to the silhouette from half coverage. */
const HALF = 127.5;

/** Averages squares of `factor` x `factor` samples. */
export function boxDown({ width, height, rgba }, factor) {
  const w = width / factor;
  const h = height / factor;
  const out = new Uint8ClampedArray(w * h * 4);
  const sums = new Uint32Array(w * 4);
  for (let y = 0; y < h; y++) {
    sums.fill(0);
    for (let dy = 0; dy < factor; dy++) {
      let from = (y * factor + dy) * width * 4;
      for (let x = 0; x < w; x++) {
        for (let dx = 0; dx < factor; dx++, from += 4) {
          for (let c = 0; c < 4; c++) sums[x * 4 + c] += rgba[from + c];
        }
      }
    }
    for (let i = 0; i < sums.length; i++) out[y * w * 4 + i] = sums[i] / (factor * factor);
  }
  return { width: w, height: h, rgba: out };
}

/** Covered pixels, summed coverage, mean colour (sRGB, 0..255, and as light, 0..1) and covered pixels in each row. */
export function measure({ width, height, rgba }) {
  const mask = new Uint8Array(width * height);
  const rows = new Float64Array(height);
  const colour = [0, 0, 0];
  const light = [0, 0, 0];
  let area = 0;
  let coverage = 0;
  for (let i = 0; i < mask.length; i++) {
    const alpha = rgba[i * 4 + 3];
    coverage += alpha / 255;
    for (let c = 0; c < 3; c++) {
      colour[c] += rgba[i * 4 + c];
      if (alpha) light[c] += (alpha / 255) * linear(rgba[i * 4 + c] / alpha);
    }
    if (alpha < HALF) continue;
    mask[i] = 1;
    area += 1;
    rows[Math.floor(i / width)] += 1;
  }
  const mean = (sum) => sum / Math.max(coverage, 1e-9);
  return { mask, rows, area, coverage, colour: colour.map(mean), light: light.map(mean) };
}

/** Light of an sRGB value, both 0..1. */
function linear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/** Mean light of several pictures, weighted by their coverage. */
export function meanLight(views) {
  const coverage = views.reduce((sum, view) => sum + view.coverage, 0);
  return [0, 1, 2].map((c) => views.reduce((sum, view) => sum + view.light[c] * view.coverage, 0) / Math.max(coverage, 1e-9));
}

/**
 * Silhouette of `measured` against that of `reference` (both from `measure`), named as in report.json. `area_ratio`
 * sums coverage; `half_area_ratio` counts covered pixels, which in a picture of few samples is too much for airy
 * crowns: two of four samples are hit far more often than half of a pixel is covered.
 */
export function compare(measured, reference) {
  let both = 0;
  for (let i = 0; i < reference.mask.length; i++) both += measured.mask[i] & reference.mask[i];
  const ratio = (a, b) => (b === 0 ? 0 : a / b);
  return {
    f1: ratio(2 * both, measured.area + reference.area),
    precision: ratio(both, measured.area),
    recall: ratio(both, reference.area),
    area_ratio: ratio(measured.coverage, reference.coverage),
    half_area_ratio: ratio(measured.area, reference.area),
    colour_error: Math.hypot(...measured.colour.map((c, i) => c - reference.colour[i])),
    upright: overlap(measured.rows, reference.rows) - overlap(measured.rows, [...reference.rows].reverse()),
  };
}

/** Share of two profiles that they have in common; 1 if they are proportional. */
function overlap(a, b) {
  const total = (rows) => Math.max(rows.reduce((sum, v) => sum + v, 0), 1e-9);
  const [ta, tb] = [total(a), total(b)];
  return a.reduce((sum, v, i) => sum + Math.min(v / ta, b[i] / tb), 0);
}

/** Mean over views, and the view that is furthest from `ideal`. */
export function summarise(views, key, ideal = 1) {
  const values = views.map((view) => view[key]);
  const mean = values.reduce((sum, v) => sum + v, 0) / values.length;
  const worst = values.reduce((far, v) => (Math.abs(v - ideal) > Math.abs(far - ideal) ? v : far));
  return { mean, worst };
}
