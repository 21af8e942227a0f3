/** A room in which a luminaire's photometric file (IES LM-63) is seen alone. */
import type { DroppedFile } from './upload';

const photometricPattern = /\.ies$/i;
export const isPhotometric = (name: string): boolean => photometricPattern.test(name);

/** Metres: the walls reach from the floor at y = 0 to the ceiling, where the luminaire hangs. */
const half = 2.5;
const ceiling = 3;
const luminaireY = 2.8;
/** The usual reflectance of walls in lighting design. */
const grey = [0.5, 0.5, 0.5, 1];

/** Quads that face into the room; it is open towards the camera at +z. */
const quads = [
  [-half, 0, half, half, 0, half, half, 0, -half, -half, 0, -half],
  [-half, 0, -half, half, 0, -half, half, ceiling, -half, -half, ceiling, -half],
  [-half, 0, half, -half, 0, -half, -half, ceiling, -half, -half, ceiling, half],
  [half, 0, -half, half, 0, half, half, ceiling, half, half, ceiling, -half],
];

function buffer(): string {
  const corners = quads.flat();
  const indices = quads.flatMap((_, i) => [0, 1, 2, 0, 2, 3].map((k) => 4 * i + k));
  const bytes = new Uint8Array(4 * corners.length + 2 * indices.length);
  new Float32Array(bytes.buffer, 0, corners.length).set(corners);
  new Uint16Array(bytes.buffer, 4 * corners.length).set(indices);
  return btoa(String.fromCharCode(...bytes));
}

/** The room as a glTF document that names the file beside it. */
export function roomFor(file: File): DroppedFile {
  const count = 4 * quads.length;
  const bytes = 12 * count;
  const document = {
    asset: { version: '2.0' },
    extensionsUsed: ['EXT_lights_ies'],
    extensions: { EXT_lights_ies: { lights: [{ uri: encodeURIComponent(file.name) }] } },
    scene: 0,
    scenes: [{ nodes: [0, 1, 2] }],
    nodes: [
      { name: 'room', mesh: 0 },
      {
        name: 'luminaire',
        translation: [0, luminaireY, 0],
        // The axis of a profile is -z; this turns it down.
        rotation: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2],
        extensions: { EXT_lights_ies: { light: 0 } },
      },
      { name: 'camera', camera: 0, translation: [0, ceiling / 2, 8] },
    ],
    cameras: [{ type: 'perspective', perspective: { yfov: 0.5, znear: 0.1 } }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: grey, metallicFactor: 0 } }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
    buffers: [
      {
        byteLength: bytes + 12 * quads.length,
        uri: `data:application/octet-stream;base64,${buffer()}`,
      },
    ],
    bufferViews: [
      { buffer: 0, byteLength: bytes },
      { buffer: 0, byteOffset: bytes, byteLength: 12 * quads.length },
    ],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count,
        type: 'VEC3',
        min: [-half, 0, -half],
        max: [half, ceiling, half],
      },
      { bufferView: 1, componentType: 5123, count: 6 * quads.length, type: 'SCALAR' },
    ],
  };
  const name = file.name.replace(photometricPattern, '.gltf');
  return { path: name, file: new File([JSON.stringify(document)], name) };
}
