// Runs in the page: two engines that read 3D Tiles look at a tree from several distances, and say what they draw.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { TilesRenderer } from '3d-tiles-renderer/three';
import * as Cesium from 'cesium';

const PX = 256;
const FOV_DEG = 60;
/** Frames in which nothing changes any more before a picture is taken. */
const QUIET = 6;
const MOST_FRAMES = 4000;

const frame = () => new Promise((done) => requestAnimationFrame(done));
const file = (url) => new URL(url, location).pathname.split('/').pop();

/** Pixels by which the original is drawn finer than the tiles, along each axis. */
const FINE = 4;

/** Pixels whose alpha says that something is there. */
function covered(rgba) {
  let count = 0;
  for (let i = 3; i < rgba.length; i += 4) count += rgba[i] > 127;
  return count;
}

function pixels(canvas, side = PX) {
  const flat = new OffscreenCanvas(side, side).getContext('2d');
  flat.drawImage(canvas, 0, 0, side, side);
  return flat.getImageData(0, 0, side, side).data;
}

function stage() {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setSize(PX, PX);
  renderer.setClearColor(0, 0);
  document.body.append(renderer.domElement);
  const scene = new THREE.Scene();
  const sun = new THREE.DirectionalLight(0xffffff, 2);
  sun.position.set(1, 2, 1.5);
  scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x808080, 2));
  const camera = new THREE.PerspectiveCamera(FOV_DEG, 1, 0.01, 1e7);
  return { renderer, scene, camera };
}

/** The camera at `distance` from the middle, from the side and a little above. */
function place(camera, [x, y, z], distance) {
  const towards = new THREE.Vector3(1, 0.3, 0.7).normalize().multiplyScalar(distance);
  camera.position.set(x, y, z).add(towards);
  camera.near = distance / 100;
  camera.far = distance * 10;
  camera.updateProjectionMatrix();
  camera.lookAt(x, y, z);
  camera.updateMatrixWorld();
}

/** What NASA's renderer shows of the tileset: files, triangles, covered pixels, a picture. */
window.nasa = async (url, middle, distances) => {
  const { renderer, scene, camera } = stage();
  const tiles = new TilesRenderer(url);
  // Tiles are z-up: three.js is not.
  tiles.group.rotation.x = -Math.PI / 2;
  scene.add(tiles.group);
  tiles.setCamera(camera);
  tiles.setResolution(camera, PX, PX);
  let failed = '';
  tiles.addEventListener('load-error', ({ error, url: at }) => (failed ||= `${at ? file(at) : ''}: ${error.message}`));
  const out = [];
  for (const distance of distances) {
    place(camera, middle, distance);
    let quiet = 0;
    for (let i = 0; quiet < QUIET; i++) {
      if (i > MOST_FRAMES || failed) throw new Error(failed || `still loading at ${distance} m`);
      scene.updateMatrixWorld(true);
      tiles.update();
      renderer.render(scene, camera);
      await frame();
      const { downloading, parsing } = tiles.stats;
      quiet = downloading + parsing === 0 && tiles.root ? quiet + 1 : 0;
    }
    const shown = [...tiles.visibleTiles].map((t) => file(t.content.uri)).sort();
    out.push({ distance, shown, triangles: renderer.info.render.triangles, covered: covered(pixels(renderer.domElement)), picture: renderer.domElement.toDataURL() });
  }
  return out;
};

/** The same looks at one GLB, supersampled and without the mips that would thin its leaves. */
window.whole = async (url, middle, distances) => {
  const { renderer, scene, camera } = stage();
  renderer.setSize(FINE * PX, FINE * PX);
  const { scene: tree } = await new GLTFLoader().loadAsync(url);
  tree.traverse(({ material }) => {
    if (!material?.map) return;
    Object.assign(material.map, { minFilter: THREE.LinearFilter, generateMipmaps: false, needsUpdate: true });
  });
  scene.add(tree);
  return distances.map((distance) => {
    place(camera, middle, distance);
    renderer.render(scene, camera);
    const fine = pixels(renderer.domElement, FINE * PX);
    return { distance, triangles: renderer.info.render.triangles, covered: covered(fine) / FINE ** 2, picture: renderer.domElement.toDataURL() };
  });
};

/** What Cesium shows of it. */
window.cesium = async (url, [x, y, z], distances) => {
  const box = document.createElement('div');
  box.id = 'cesium';
  document.body.append(box);
  const widget = new Cesium.CesiumWidget(box, {
    baseLayer: false,
    globe: false,
    skyBox: false,
    skyAtmosphere: false,
    scene3DOnly: true,
    useDefaultRenderLoop: false,
    contextOptions: { webgl: { alpha: true, preserveDrawingBuffer: true } },
  });
  const { scene } = widget;
  scene.backgroundColor = Cesium.Color.TRANSPARENT;
  scene.light = new Cesium.DirectionalLight({ direction: new Cesium.Cartesian3(-1, 1.5, -2), intensity: 2 });
  const tileset = scene.primitives.add(await Cesium.Cesium3DTileset.fromUrl(url));
  let failed = '';
  tileset.tileFailed.addEventListener(({ url: at, message }) => (failed ||= `${file(at)}: ${message}`));
  let shown = new Set();
  tileset.tileVisible.addEventListener((tile) => shown.add(file(tile.content.url)));
  const out = [];
  for (const distance of distances) {
    // z-up: (x, y, z) is at (x, -z, y).
    const towards = Cesium.Cartesian3.normalize(new Cesium.Cartesian3(1, -0.7, 0.3), new Cesium.Cartesian3());
    const middle = new Cesium.Cartesian3(x, -z, y);
    const eye = Cesium.Cartesian3.add(middle, Cesium.Cartesian3.multiplyByScalar(towards, distance, new Cesium.Cartesian3()), new Cesium.Cartesian3());
    const direction = Cesium.Cartesian3.negate(towards, new Cesium.Cartesian3());
    const right = Cesium.Cartesian3.normalize(Cesium.Cartesian3.cross(direction, Cesium.Cartesian3.UNIT_Z, new Cesium.Cartesian3()), new Cesium.Cartesian3());
    const up = Cesium.Cartesian3.cross(right, direction, new Cesium.Cartesian3());
    scene.camera.frustum = new Cesium.PerspectiveFrustum({ fov: Cesium.Math.toRadians(FOV_DEG), aspectRatio: 1, near: distance / 100, far: distance * 10 });
    scene.camera.setView({ destination: eye, orientation: { direction, up } });
    let quiet = 0;
    for (let i = 0; quiet < QUIET; i++) {
      if (i > MOST_FRAMES || failed) throw new Error(failed || `still loading at ${distance} m`);
      shown = new Set();
      widget.resize();
      widget.render();
      await frame();
      quiet = tileset.tilesLoaded ? quiet + 1 : 0;
    }
    out.push({ distance, shown: [...shown].sort(), covered: covered(pixels(scene.canvas)), picture: scene.canvas.toDataURL() });
  }
  widget.destroy();
  return out;
};

window.ready = true;
