/** Where the cameras of a glTF document stand, so that composing can begin from them. */

export interface PlacedCamera {
  name: string;
  position: [number, number, number];
  /** Unit vector. */
  forward: [number, number, number];
  verticalFovDegrees: number;
}

interface Node {
  name?: string;
  camera?: number;
  children?: number[];
  matrix?: number[];
  translation?: number[];
  rotation?: number[];
  scale?: number[];
}

interface Document {
  scene?: number;
  scenes?: { nodes?: number[] }[];
  nodes?: Node[];
  cameras?: { name?: string; perspective?: { yfov: number } }[];
}

/** Column-major 4 x 4. */
type Matrix = number[];
const identity: Matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

function multiply(a: Matrix, b: Matrix): Matrix {
  return Array.from({ length: 16 }, (_, i) => {
    const row = i % 4;
    const column = 4 * Math.floor(i / 4);
    return [0, 1, 2, 3].reduce((sum, k) => sum + a[row + 4 * k] * b[column + k], 0);
  });
}

function localMatrix(node: Node): Matrix {
  if (node.matrix) return node.matrix;
  const [x, y, z, w] = node.rotation ?? [0, 0, 0, 1];
  const [sx, sy, sz] = node.scale ?? [1, 1, 1];
  const [tx, ty, tz] = node.translation ?? [0, 0, 0];
  return [
    (1 - 2 * (y * y + z * z)) * sx,
    2 * (x * y + z * w) * sx,
    2 * (x * z - y * w) * sx,
    0,
    2 * (x * y - z * w) * sy,
    (1 - 2 * (x * x + z * z)) * sy,
    2 * (y * z + x * w) * sy,
    0,
    2 * (x * z + y * w) * sz,
    2 * (y * z - x * w) * sz,
    (1 - 2 * (x * x + y * y)) * sz,
    0,
    tx,
    ty,
    tz,
    1,
  ];
}

/** Perspective cameras in the order of the scene's nodes. */
export function placedCameras(document: Document): PlacedCamera[] {
  const out: PlacedCamera[] = [];
  const visit = (index: number, parent: Matrix, depth: number): void => {
    const node = document.nodes?.[index];
    if (!node || depth > 64) return;
    const world = multiply(parent, localMatrix(node));
    const camera = node.camera === undefined ? null : document.cameras?.[node.camera];
    if (camera?.perspective) {
      const length = Math.hypot(world[8], world[9], world[10]) || 1;
      out.push({
        name: camera.name ?? node.name ?? '',
        position: [world[12], world[13], world[14]],
        forward: [-world[8] / length, -world[9] / length, -world[10] / length],
        verticalFovDegrees: (camera.perspective.yfov * 180) / Math.PI,
      });
    }
    for (const child of node.children ?? []) visit(child, world, depth + 1);
  };
  for (const root of document.scenes?.[document.scene ?? 0]?.nodes ?? []) visit(root, identity, 0);
  return out;
}

/** The JSON part of a GLB. Throws if it is none. */
export function documentOfGlb(bytes: ArrayBuffer): Document {
  const view = new DataView(bytes);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error('not a GLB');
  const length = view.getUint32(12, true);
  return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, length))) as Document;
}
