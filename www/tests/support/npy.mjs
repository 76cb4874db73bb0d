// NumPy's .npy files of version 1 to 3, as the command line writes them.

import { readFile } from "node:fs/promises";

const READERS = { "<f4": [Float32Array, 4], "|u1": [Uint8Array, 1], "|b1": [Uint8Array, 1], "<f8": [Float64Array, 8] };

/**
 * @param {string} file
 * @returns {Promise<{ shape: number[], values: Float32Array | Float64Array | Uint8Array }>}
 */
export async function readNpy(file) {
  const bytes = await readFile(file);
  if (bytes.toString("latin1", 1, 6) !== "NUMPY" || bytes[0] !== 0x93) throw new Error(`${file} is not an .npy file`);
  const long = bytes[6] > 1;
  const length = long ? bytes.readUInt32LE(8) : bytes.readUInt16LE(8);
  const start = (long ? 12 : 10) + length;
  const header = bytes.toString("latin1", long ? 12 : 10, start);
  const [, kind] = /'descr':\s*'([^']+)'/.exec(header) ?? [];
  const [, sizes] = /'shape':\s*\(([^)]*)\)/.exec(header) ?? [];
  const reader = READERS[kind];
  if (!reader || sizes === undefined || !/'fortran_order':\s*False/.test(header))
    throw new Error(`${file}: unsupported header ${header}`);
  const shape = sizes
    .split(",")
    .filter((size) => size.trim() !== "")
    .map(Number);
  const [Values, width] = reader;
  const count = shape.reduce((product, size) => product * size, 1);
  const copy = Uint8Array.prototype.slice.call(bytes, start, start + count * width);
  if (copy.length !== count * width) throw new Error(`${file} is truncated`);
  return { shape, values: new Values(copy.buffer) };
}
