// From where a tree is looked at: the views of `pleach evaluate`, azimuths at three elevations, and the top.

const ELEVATIONS = [-15, 0, 30];

/** `around` azimuths at each elevation, the rings turned against each other, and the top; degrees. */
export function views(around = 5) {
  const list = [];
  ELEVATIONS.forEach((elevation, ring) => {
    for (let i = 0; i < around; i++) {
      list.push({ azimuth: ((i + ring / ELEVATIONS.length) * 360) / around, elevation });
    }
  });
  return [...list, { azimuth: 0, elevation: 90 }];
}

/** "0/0,45/30,0/90" as views. */
export function parseViews(text) {
  return text.split(',').map((pair) => {
    const [azimuth, elevation] = pair.split('/').map(Number);
    if (!Number.isFinite(azimuth) || !Number.isFinite(elevation)) throw new Error(`view ${pair}: expected AZIMUTH/ELEVATION`);
    return { azimuth, elevation };
  });
}
