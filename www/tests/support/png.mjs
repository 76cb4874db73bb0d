// PNG files of 8 and 16 bits without interlacing, as the command line writes them.

import { crc32, deflateSync, inflateSync } from "node:zlib";

const CHANNELS = { 0: 1, 2: 3, 4: 2, 6: 4 };

/** The predictor of PNG's fifth filter. */
function paeth(left, up, upLeft) {
  const [pa, pb, pc] = [Math.abs(up - upLeft), Math.abs(left - upLeft), Math.abs(left + up - 2 * upLeft)];
  return pa <= pb && pa <= pc ? left : pb <= pc ? up : upLeft;
}

/**
 * Adds to each byte of a row what its filter predicted. A loop for each filter: pictures of tests have tens of millions of bytes.
 *
 * @param {Uint8Array} raw the rows so far
 * @param {number} from where the row begins
 * @param {number} stride its bytes
 * @param {number} pixel bytes of a pixel
 * @param {number} filter as PNG numbers them
 */
function unfilter(raw, from, stride, pixel, filter) {
  const end = from + stride;
  // Above the first row and left of the first pixel all is 0.
  const up = (at) => (from > 0 ? raw[at - stride] : 0);
  if (filter === 1) for (let at = from + pixel; at < end; at++) raw[at] += raw[at - pixel];
  else if (filter === 2 && from > 0) for (let at = from; at < end; at++) raw[at] += raw[at - stride];
  else if (filter === 3) {
    for (let at = from; at < end; at++) raw[at] += ((at - from >= pixel ? raw[at - pixel] : 0) + up(at)) >> 1;
  } else if (filter === 4) {
    for (let at = from; at < end; at++) raw[at] += at - from >= pixel ? paeth(raw[at - pixel], up(at), up(at - pixel)) : up(at);
  }
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
  const raw = new Uint8Array(stride * height);
  for (let row = 0; row < height; row++) {
    const filter = packed[row * (stride + 1)];
    raw.set(packed.subarray(row * (stride + 1) + 1, (row + 1) * (stride + 1)), row * stride);
    unfilter(raw, row * stride, stride, pixel, filter);
  }
  if (depth === 8) return { width, height, channels, values: raw };
  return {
    width,
    height,
    channels,
    values: Uint16Array.from({ length: raw.length / 2 }, (_, i) => 256 * raw[2 * i] + raw[2 * i + 1]),
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
