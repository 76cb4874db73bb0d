// Scans of bent sheets as scanners' programs write them: y up, the viewer on the +z side.

import { readFile } from "node:fs/promises";
import { join } from "node:path";

import { MODEL } from "./native.mjs";
import { decodePng, encodePng } from "./png.mjs";

/**
 * A sheet that is rolled about an upright axis, its print outside.
 *
 * @param {{ widthMm: number, heightMm: number, radiusMm: number }} sheet
 * @returns {{ positions: number[][], uvs: number[][], faces: number[][] }} mm; v down
 */
export function bentSheet({ widthMm, heightMm, radiusMm }) {
  const [columns, rows] = [40, 20];
  const [positions, uvs, faces] = [[], [], []];
  for (let j = 0; j <= rows; j++) {
    for (let i = 0; i <= columns; i++) {
      const [u, v] = [i / columns, j / rows];
      const angle = ((u - 0.5) * widthMm) / radiusMm;
      positions.push([radiusMm * Math.sin(angle), (0.5 - v) * heightMm, radiusMm * Math.cos(angle)]);
      uvs.push([u, v]);
      const at = j * (columns + 1) + i;
      if (i < columns && j < rows) faces.push([at, at + columns + 1, at + columns + 2], [at, at + columns + 2, at + 1]);
    }
  }
  return { positions, uvs, faces };
}

/** A ball, whose texture is wrapped once around it. @param {number} radiusMm */
export function ball(radiusMm) {
  const { uvs, faces } = bentSheet({ widthMm: 1, heightMm: 1, radiusMm: 1 });
  const positions = uvs.map(([u, v]) => {
    const [longitude, latitude] = [(u % 1) * 2 * Math.PI, (v - 0.5) * Math.PI];
    return [Math.sin(longitude) * Math.cos(latitude), -Math.sin(latitude), Math.cos(longitude) * Math.cos(latitude)].map((x) => (Math.abs(x) < 1e-12 ? 0 : radiusMm * x));
  });
  return { positions, uvs, faces };
}

/**
 * Binary glTF, in metres. The texture lies in it turned by a quarter, as programs that pack textures leave it.
 *
 * @param {{ positions: number[][], uvs: number[][], faces: number[][] }} mesh
 * @param {{ width: number, height: number, values: Uint8Array }} print RGB
 */
export function glbOf({ positions, uvs, faces }, print) {
  const floats = (rows) => Buffer.from(Float32Array.from(rows.flat()).buffer);
  const parts = [floats(positions.map((p) => p.map((mm) => mm / 1000))), floats(uvs.map(([u, v]) => [1 - v, u])), Buffer.from(Uint32Array.from(faces.flat()).buffer), encodePng(turned(print))];
  let offset = 0;
  const bufferViews = parts.map(({ length }) => {
    const view = { buffer: 0, byteOffset: offset, byteLength: length };
    offset += Math.ceil(length / 4) * 4;
    return view;
  });
  const accessor = (bufferView, componentType, count, type) => ({ bufferView, componentType, count, type });
  const document = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1 }, indices: 2, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }],
    textures: [{ source: 0 }],
    images: [{ bufferView: 3, mimeType: "image/png" }],
    accessors: [accessor(0, 5126, positions.length, "VEC3"), accessor(1, 5126, uvs.length, "VEC2"), accessor(2, 5125, 3 * faces.length, "SCALAR")],
    bufferViews,
    buffers: [{ byteLength: offset }],
  };
  const padded = (bytes, filler) => Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4, filler)]);
  const json = padded(Buffer.from(JSON.stringify(document)), " ");
  const binary = Buffer.concat(parts.map((part) => padded(part, 0)));
  const word = (value) => Buffer.from(Uint32Array.of(value).buffer);
  const chunks = [word(json.length), Buffer.from("JSON"), json, word(binary.length), Buffer.from("BIN\0"), binary];
  const length = 12 + chunks.reduce((sum, chunk) => sum + chunk.length, 0);
  return Buffer.concat([Buffer.from("glTF"), word(2), word(length), ...chunks]);
}

/** A picture turned by a quarter clockwise. */
function turned({ width, height, values }) {
  const result = new Uint8Array(values.length);
  for (let y = 0; y < width; y++)
    for (let x = 0; x < height; x++) {
      const from = 3 * ((height - 1 - x) * width + y);
      result.set(values.subarray(from, from + 3), 3 * (y * height + x));
    }
  return { width: height, height: width, values: result };
}

/**
 * Wavefront OBJ, whose unit is the millimetre, with its materials.
 *
 * @param {{ positions: number[][], uvs: number[][], faces: number[][] }} mesh
 * @param {string} picture name of the texture's file
 * @returns {{ obj: Buffer, mtl: Buffer }} the materials are "sheet.mtl"
 */
export function objOf({ positions, uvs, faces }, picture) {
  const corner = (vertex) => `${vertex + 1}/${vertex + 1}`;
  const lines = [
    "mtllib sheet.mtl",
    ...positions.map((p) => `v ${p.join(" ")}`),
    ...uvs.map(([u, v]) => `vt ${u} ${1 - v}`),
    "usemtl print",
    ...faces.map((face) => `f ${face.map(corner).join(" ")}`),
  ];
  return { obj: Buffer.from(lines.join("\n")), mtl: Buffer.from(`newmtl print\nmap_Kd ${picture}\n`) };
}

/** The poster, rolled by 85 degrees, as a file that a page is given. */
export async function posterScan() {
  const print = decodePng(await readFile(join(MODEL, "template", "texture.png")));
  const buffer = glbOf(bentSheet({ widthMm: 297, heightMm: 210, radiusMm: 200 }), print);
  return { name: "poster.glb", mimeType: "model/gltf-binary", buffer };
}
