// Binary glTF files, as the command line writes them.

/**
 * Vertex positions of the first mesh in our camera frame: mm, x right, y down, z forward. glTF counts in metres, y up, z
 * towards the viewer.
 *
 * @param {Buffer} file
 * @returns {Float32Array} (x, y, z) each
 */
export function glbPositions(file) {
  if (file.toString("latin1", 0, 4) !== "glTF" || file.readUInt32LE(4) !== 2) throw new Error("not a glTF 2.0 file");
  const jsonLength = file.readUInt32LE(12);
  const document = JSON.parse(file.toString("utf8", 20, 20 + jsonLength));
  const binary = 20 + jsonLength + 8;
  const accessor = document.accessors[document.meshes[0].primitives[0].attributes.POSITION];
  const start = binary + (document.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  return Float32Array.from(
    { length: 3 * accessor.count },
    (_, i) => file.readFloatLE(start + 4 * i) * (i % 3 === 0 ? 1000 : -1000),
  );
}
