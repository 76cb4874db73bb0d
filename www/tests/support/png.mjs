// PNG files of 8 and 16 bits without interlacing, as the command line writes them.

import { crc32, deflateSync, inflateSync } from "node:zlib";

const CHANNELS = { 0: 1, 2: 3, 4: 2, 6: 4 };

/** The predictor of PNG's fifth filter. */
function paeth(left, up, upLeft) {
  const [pa, pb, pc] = [Math.abs(up - upLeft), Math.abs(left - upLeft), Math.abs(left + up - 2 * upLeft)];
  return pa <= pb && pa <= pc ? left : pb <= pc ? up : upLeft;
}

/**
 * @param {Uint8Array} file
 * @returns {{ width: number, height: number, channels: number, values: Uint8Array | Uint16Array }}
 */
export function decodePng(file) {
  const bytes = Buffer.from(file.buffer, file.byteOffset, file.byteLength);
  const chunks = [];
  let header;
  for (let at = 8; at < bytes.length; at += 12 + bytes.readUInt32BE(at)) {
    const [length, kind] = [bytes.readUInt32BE(at), bytes.toString("latin1", at + 4, at + 8)];
    const body = bytes.subarray(at + 8, at + 8 + length);
    if (kind === "IHDR") header = body;
    if (kind === "IDAT") chunks.push(body);
  }
  const [width, height, depth, color, interlace] = [
    header.readUInt32BE(0),
    header.readUInt32BE(4),
    header[8],
    header[9],
    header[12],
  ];
  const channels = CHANNELS[color];
  if (!channels || (depth !== 8 && depth !== 16) || interlace !== 0) throw new Error("unsupported kind of PNG");
  const pixel = (channels * depth) / 8;
  const stride = width * pixel;
  const packed = inflateSync(Buffer.concat(chunks));
  const raw = Buffer.alloc(stride * height);
  for (let row = 0; row < height; row++) {
    const filter = packed[row * (stride + 1)];
    for (let i = 0; i < stride; i++) {
      const at = row * stride + i;
      const left = i >= pixel ? raw[at - pixel] : 0;
      const up = row > 0 ? raw[at - stride] : 0;
      const upLeft = i >= pixel && row > 0 ? raw[at - stride - pixel] : 0;
      const predicted = [0, left, up, (left + up) >> 1, paeth(left, up, upLeft)][filter];
      raw[at] = packed[row * (stride + 1) + 1 + i] + predicted;
    }
  }
  if (depth === 8) return { width, height, channels, values: new Uint8Array(raw) };
  return {
    width,
    height,
    channels,
    values: Uint16Array.from({ length: raw.length / 2 }, (_, i) => raw.readUInt16BE(2 * i)),
  };
}

/**
 * A chunk of a PNG file: length, kind, content, checksum.
 *
 * @param {string} kind
 * @param {Buffer} body
 */
export function pngChunk(kind, body) {
  const bytes = Buffer.concat([Buffer.from(kind, "latin1"), body]);
  const framed = Buffer.alloc(8 + bytes.length);
  framed.writeUInt32BE(body.length, 0);
  bytes.copy(framed, 4);
  framed.writeUInt32BE(crc32(bytes), 4 + bytes.length);
  return framed;
}

/**
 * @param {{ width: number, height: number, values: Uint8Array, channels?: 3 | 4 }} picture 8 bits each, RGB or RGBA
 * @returns {Buffer}
 */
export function encodePng({ width, height, values, channels = 3 }) {
  const header = Buffer.alloc(13);
  header.writeUInt32BE(width, 0);
  header.writeUInt32BE(height, 4);
  header.set([8, channels === 4 ? 6 : 2], 8);
  const stride = channels * width;
  const rows = Buffer.alloc((stride + 1) * height);
  for (let row = 0; row < height; row++) rows.set(values.subarray(row * stride, (row + 1) * stride), row * (stride + 1) + 1);
  return Buffer.concat([
    Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]),
    pngChunk("IHDR", header),
    pngChunk("IDAT", deflateSync(rows)),
    pngChunk("IEND", Buffer.alloc(0)),
  ]);
}
