// From where a tree is looked at: the views of `pleach evaluate`.

const ELEVATIONS = [0, 30, -15];

/** `around` azimuths at each elevation, and the top; degrees. `offset` turns them: other views than those fitted to. */
export function views(around, offset = 0) {
  const list = [];
  for (const elevation of ELEVATIONS) {
    for (let i = 0; i < around; i++) list.push({ azimuth: (i * 360) / around + offset, elevation });
  }
  return [...list, { azimuth: offset, elevation: 90 }];
}

/** "0/0,45/30,0/90" as views. */
export function parseViews(text) {
  return text.split(',').map((pair) => {
    const [azimuth, elevation] = pair.split('/').map(Number);
    if (!Number.isFinite(azimuth) || !Number.isFinite(elevation)) throw new Error(`view ${pair}: expected AZIMUTH/ELEVATION`);
    return { azimuth, elevation };
  });
}
