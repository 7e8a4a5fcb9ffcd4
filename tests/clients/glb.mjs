// Reads the JSON of a binary glTF 2.0 file, with no library that could share a fault with the writer.
import { readFileSync } from 'node:fs';

const MAGIC = 0x46546c67; // "glTF"
const JSON_CHUNK = 0x4e4f534a; // "JSON"

/** The root object of `file`; an error names what is wrong with the container. */
export function readGlbJson(file) {
  const bytes = readFileSync(file);
  if (bytes.length < 20 || bytes.readUInt32LE(0) !== MAGIC) throw new Error(`${file}: not a binary glTF`);
  const length = bytes.readUInt32LE(12);
  if (bytes.readUInt32LE(16) !== JSON_CHUNK) throw new Error(`${file}: the first chunk is not JSON`);
  return JSON.parse(bytes.toString('utf8', 20, 20 + length));
}

/** Triangles that the default scene draws, nodes that share a mesh counted each. */
export function trianglesInScene(gltf) {
  let triangles = 0;
  const visit = (index) => {
    const node = gltf.nodes[index];
    const instances = gltf.accessors?.[
      Object.values(node.extensions?.EXT_mesh_gpu_instancing?.attributes ?? {})[0]
    ]?.count ?? 1;
    for (const primitive of gltf.meshes?.[node.mesh]?.primitives ?? []) {
      if ((primitive.mode ?? 4) !== 4) continue;
      const corners = gltf.accessors[primitive.indices ?? primitive.attributes.POSITION].count;
      triangles += (corners / 3) * instances;
    }
    (node.children ?? []).forEach(visit);
  };
  sceneRoots(gltf).forEach(visit);
  return triangles;
}

/** The root nodes of the default scene. */
export function sceneRoots(gltf) {
  return gltf.scenes?.[gltf.scene ?? 0]?.nodes ?? [];
}

/** Every node under `roots`, themselves included. */
export function reachable(gltf, roots) {
  const seen = new Set();
  const visit = (index) => {
    if (seen.has(index) || !gltf.nodes?.[index]) return;
    seen.add(index);
    (gltf.nodes[index].children ?? []).forEach(visit);
  };
  roots.forEach(visit);
  return seen;
}
