// Runs in the page: three.js with its defaults draws trees, and the pictures are read back.
//
// Two ways of drawing. `client` is what a page shows: one frame on an antialiased canvas, textures with mips, alpha
// test. `reference` is the same scene with `SUPERSAMPLE` squared frames' worth of samples, every one taken from the
// texture itself: mips would thin the leaves that the reference is there to count.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { boxDown, compare, measure } from './measures.mjs';

const SUPERSAMPLE = 4;

function canvas(antialias) {
  const renderer = new THREE.WebGLRenderer({ antialias, alpha: true });
  renderer.setPixelRatio(1);
  renderer.setClearColor(0x000000, 0);
  return renderer;
}
const renderers = { client: canvas(true), reference: canvas(false) };
const gl = renderers.client.getContext();

/** The file's default scene under a fixed sky and sun, with its bounding box and what it costs. */
async function load(url) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  const { scene } = await loader.loadAsync(url);
  const lit = new THREE.Scene();
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(1, 2, 1.5);
  lit.add(scene, sun, new THREE.HemisphereLight(0xffffff, 0x808080, 2));
  lit.updateMatrixWorld(true);
  let cut = false;
  for (const material of materials(lit)) cut ||= material.alphaTest > 0 || material.transparent;
  return { scene: lit, box: new THREE.Box3().setFromObject(scene, true), cut };
}

function materials(scene) {
  const found = new Set();
  scene.traverse((object) => object.isMesh && [object.material].flat().forEach((m) => found.add(m)));
  return found;
}

function textures(scene) {
  const found = new Set();
  for (const material of materials(scene)) {
    for (const value of Object.values(material)) if (value?.isTexture) found.add(value);
  }
  return found;
}

function unload({ scene }) {
  scene.traverse((object) => object.geometry?.dispose());
  for (const texture of textures(scene)) {
    texture.dispose();
    texture.image?.close?.();
  }
  for (const material of materials(scene)) material.dispose();
}

/** Base colours alone, as they are cut by alpha; returns a function that brings the materials back. */
function withoutLight(scene) {
  const before = [];
  scene.traverse((object) => {
    if (!object.isMesh) return;
    before.push([object, object.material]);
    const plain = ({ map, color, alphaTest, side, vertexColors, transparent, opacity }) =>
      new THREE.MeshBasicMaterial({ map, color, alphaTest, side, vertexColors, transparent, opacity });
    object.material = Array.isArray(object.material) ? object.material.map(plain) : plain(object.material);
  });
  return () => before.forEach(([object, material]) => (object.material = material));
}

/** Takes mips away: what the reference samples. */
function withoutMips(scene) {
  for (const texture of textures(scene)) {
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    texture.dispose();
    texture.needsUpdate = true;
  }
}

/** The eye stays at least so many radii away; where it would come nearer the lens is longer: as in `View::camera_through`. */
const NEAREST_EYE = 1.5;

/**
 * A camera for which `box` is `heightPx` high at its middle, and the side in pixels of a square picture in which it fits
 * from every side. `focal` is the focal length in pixels, 0 for parallel rays; the eye is where the height takes
 * `heightPx` through that lens.
 */
function camera(box, heightPx, { azimuth, elevation }, focal) {
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const perMetre = heightPx / (box.max.y - box.min.y);
  const centre = box.getCenter(new THREE.Vector3());
  const distance = focal > 0 ? Math.max(focal / perMetre, NEAREST_EYE * radius) : 4 * radius;
  // Lines of sight that touch the sphere around the tree.
  const half = focal > 0 ? (distance * perMetre * radius) / Math.sqrt(distance ** 2 - radius ** 2) : radius * perMetre;
  const side = 2 * Math.ceil(half) + 4;
  const [near, far] = [distance - 1.02 * radius, distance + 1.02 * radius];
  const metres = side / perMetre / 2;
  const eye = focal > 0
    ? new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(2 * Math.atan(metres / distance)), 1, near, far)
    : new THREE.OrthographicCamera(-metres, metres, metres, -metres, near, far);
  const [a, e] = [THREE.MathUtils.degToRad(azimuth), THREE.MathUtils.degToRad(elevation)];
  const towards = new THREE.Vector3(Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a));
  if (Math.abs(elevation) > 89.9) eye.up.set(-Math.sin(a), 0, -Math.cos(a));
  eye.position.copy(centre).addScaledVector(towards, distance);
  eye.lookAt(centre);
  return { eye, side };
}

/** One frame, read back from the canvas with its rows from the top down. */
function frame(renderer, scene, eye, pixels) {
  const gl = renderer.getContext();
  if (pixels > gl.getParameter(gl.MAX_RENDERBUFFER_SIZE)) throw new Error(`${pixels} pixels are too many`);
  renderer.setSize(pixels, pixels, false);
  renderer.render(scene, eye);
  const upward = new Uint8Array(pixels * pixels * 4);
  gl.readPixels(0, 0, pixels, pixels, gl.RGBA, gl.UNSIGNED_BYTE, upward);
  const rgba = new Uint8Array(upward.length);
  const row = pixels * 4;
  for (let y = 0; y < pixels; y++) rgba.set(upward.subarray((pixels - 1 - y) * row, (pixels - y) * row), y * row);
  return { width: pixels, height: pixels, rgba };
}

/** Pictures kept for the sheets: sheets[height][row label] = pictures. */
const sheets = new Map();

function keep(heightPx, label, picture) {
  if (!sheets.has(heightPx)) sheets.set(heightPx, new Map());
  const rows = sheets.get(heightPx);
  if (!rows.has(label)) rows.set(label, []);
  rows.get(label).push(picture);
}

/** The original's box and reference silhouettes: references[height][view]. */
let original;
const references = new Map();

/**
 * Draws one file from all views at each height. The first file is the original: it sets the frame and the reference
 * that all are measured against. Returns, for each height and mode, one row of figures a view.
 */
window.measureFile = async ({ url, label, modes, heights, views, shown, focal }) => {
  const tree = await load(url);
  if (!original) original = { box: tree.box };
  const results = [];
  for (const mode of modes) {
    if (mode === 'reference') withoutMips(tree.scene);
    const light = mode === 'unlit' ? withoutLight(tree.scene) : () => {};
    for (const height of heights) {
      const factor = mode === 'reference' ? SUPERSAMPLE : 1;
      const rows = views.map((view, index) => {
        const { eye, side: pixels } = camera(original.box, height, view, focal);
        const picture = boxDown(frame(renderers[mode === 'reference' ? mode : 'client'], tree.scene, eye, pixels * factor), factor);
        if (shown.includes(index) && mode !== 'unlit') keep(height, `${label}, ${mode}`, picture);
        return { view, measured: measure(picture) };
      });
      results.push({ mode, height_px: height, rows });
    }
    light();
  }
  for (const { mode, height_px, rows } of results) {
    if (mode === 'reference' && !references.has(height_px)) references.set(height_px, rows.map((row) => row.measured));
  }
  unload(tree);
  return {
    alpha_cut: tree.cut,
    results: results.map(({ mode, height_px, rows }) => ({
      mode,
      height_px,
      views: rows.map(({ view, measured }, index) => ({
        ...view,
        area_px: measured.area,
        colour: measured.colour,
        light: measured.light,
        coverage: measured.coverage,
        ...compare(measured, references.get(height_px)[index]),
      })),
    })),
  };
};

/** All pictures of one height in a grid, as a data URL: a file and mode a row, a view a column. */
window.sheet = (heightPx) => {
  const rows = [...sheets.get(heightPx)];
  const zoom = Math.max(1, Math.floor(200 / heightPx));
  const cell = rows[0][1][0].width * zoom;
  const canvas = new OffscreenCanvas(cell * rows[0][1].length, (cell + 18) * rows.length);
  const pen = canvas.getContext('2d');
  pen.fillStyle = '#b8c8d8';
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.fillStyle = '#000';
  pen.font = '14px sans-serif';
  pen.imageSmoothingEnabled = false;
  rows.forEach(([label, pictures], y) => {
    pen.fillText(label, 6, y * (cell + 18) + 14);
    pictures.forEach((picture, x) => {
      const small = new OffscreenCanvas(picture.width, picture.height);
      small.getContext('2d').putImageData(straight(picture), 0, 0);
      pen.drawImage(small, x * cell, y * (cell + 18) + 18, cell, cell);
    });
  });
  return canvas.convertToBlob({ type: 'image/png' }).then(
    (blob) => new Promise((done) => {
      const reader = new FileReader();
      reader.onload = () => done(reader.result);
      reader.readAsDataURL(blob);
    }),
  );
};

/** Premultiplied bytes as the straight ones that a 2D canvas takes. */
function straight({ width, height, rgba }) {
  const out = new ImageData(width, height);
  for (let i = 0; i < rgba.length; i += 4) {
    const alpha = rgba[i + 3];
    for (let c = 0; c < 3; c++) out.data[i + c] = alpha ? (rgba[i + c] * 255) / alpha : 0;
    out.data[i + 3] = alpha;
  }
  return out;
}

window.about = () => ({
  three: `r${THREE.REVISION}`,
  samples: gl.getParameter(gl.SAMPLES),
  renderer: gl.getParameter(gl.RENDERER),
});
window.ready = true;
