// Spoils a file in one way, so that it can be seen that the checks would notice.
//
//   node spoil.mjs IN.glb OUT.glb upside-down|small|blue|required
import { writeFileSync, readFileSync } from 'node:fs';
import { readGlbJson, sceneRoots } from './glb.mjs';

const WAYS = {
  'upside-down': (gltf) => wrap(gltf, { rotation: [1, 0, 0, 0], translation: [0, heightOf(gltf), 0] }),
  small: (gltf) => wrap(gltf, { scale: [0.3, 0.3, 0.3] }),
  blue: (gltf) => {
    for (const material of gltf.materials) {
      material.pbrMetallicRoughness = { ...material.pbrMetallicRoughness, baseColorFactor: [0.1, 0.1, 1, 1] };
    }
  },
  required: (gltf) => {
    gltf.extensionsUsed = [...(gltf.extensionsUsed ?? []), 'PLEACH_none'];
    gltf.extensionsRequired = ['PLEACH_none'];
  },
};

/** Puts all roots of the scene under a node with this transform. */
function wrap(gltf, transform) {
  gltf.nodes.push({ ...transform, children: sceneRoots(gltf) });
  gltf.scenes[gltf.scene ?? 0].nodes = [gltf.nodes.length - 1];
}

/** Top of all positions, in their own spaces: near enough to turn a tree about its middle. */
function heightOf(gltf) {
  const tops = gltf.meshes.flatMap((m) => m.primitives.map((p) => gltf.accessors[p.attributes.POSITION].max[1]));
  return Math.max(...tops);
}

const [input, output, way] = process.argv.slice(2);
if (!WAYS[way]) {
  console.error(`usage: node spoil.mjs IN.glb OUT.glb ${Object.keys(WAYS).join('|')}`);
  process.exit(2);
}
const gltf = readGlbJson(input);
WAYS[way](gltf);
const bytes = readFileSync(input);
const binary = bytes.subarray(20 + bytes.readUInt32LE(12));
const json = Buffer.from(JSON.stringify(gltf));
const padded = Buffer.concat([json, Buffer.alloc(-json.length & 3, ' ')]);
const head = Buffer.alloc(20);
head.write('glTF');
[2, 20 + padded.length + binary.length, padded.length, 0x4e4f534a].forEach((v, i) => head.writeUInt32LE(v, 4 + 4 * i));
writeFileSync(output, Buffer.concat([head, padded, binary]));
