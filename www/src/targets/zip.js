// The files of a scan out of a ZIP archive. The browser inflates them.

import { unusable } from "./target-source.js";

/** Files that scans are made of, and what macOS adds to archives. */
const PARTS = /\.(obj|ply|mtl|glb|gltf|bin|png|jpe?g|webp|avif|gif|bmp|hei[cf]|tiff?)$/i;
const SCANS = /\.(obj|ply|glb|gltf)$/i;
const ADDED = /(^|\/)(__MACOSX\/|\._)/;

/** Most bytes of all files together, unpacked. */
const MAX_BYTES = 1 << 29;

/** First words of the end of the directory, of an entry of it, and of a file. */
const [END, ENTRY, FILE] = [0x06054b50, 0x02014b50, 0x04034b50];
const [END_BYTES, LONGEST_COMMENT] = [22, 0xffff];
const [STORED, DEFLATED] = [0, 8];

/**
 * Unpacks what scans are made of. Paths are from the folder of the scan's own file; files elsewhere have their names alone.
 *
 * @param {string} name of the archive
 * @param {Uint8Array} bytes
 * @returns {Promise<[string, Uint8Array][]>}
 * @throws {import("../error.js").DeepSftError} `target-unusable` when it is broken, encrypted, ZIP64, packed in another way or too large
 */
export async function unzipped(name, bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const word = (/** @type {number} */ at, /** @type {number} */ expected) => {
    if (view.getUint32(at, true) !== expected) throw new RangeError(`${at} begins nothing`);
  };
  const refused = (/** @type {string} */ reason, /** @type {unknown} */ cause = undefined) => unusable(`${name} cannot be unpacked: ${reason}.`, cause);
  try {
    let end = bytes.length - END_BYTES;
    const first = Math.max(0, end - LONGEST_COMMENT);
    while (end > first && view.getUint32(end, true) !== END) end--;
    word(end, END);
    const [count, start] = [view.getUint16(end + 10, true), view.getUint32(end + 16, true)];
    if (count === 0xffff || start === 0xffffffff) throw refused("it is ZIP64, for gigabytes. Pack the scan alone");
    const entries = [];
    for (let at = start, i = 0; i < count; i++) {
      word(at, ENTRY);
      const [flags, method, length, extra, comment] = [8, 10, 28, 30, 32].map((field) => view.getUint16(at + field, true));
      const [packed, size, offset] = [20, 24, 42].map((field) => view.getUint32(at + field, true));
      const path = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + length)).replaceAll("\\", "/");
      if (PARTS.test(path) && !ADDED.test(path)) entries.push({ path, isEncrypted: flags & 1, method, packed, size, offset });
      at += 46 + length + extra + comment;
    }
    if (entries.reduce((sum, { size }) => sum + size, 0) > MAX_BYTES) throw refused(`its files have more than ${MAX_BYTES >> 20} MiB. Make the pictures smaller`);
    const folder = entries.find(({ path }) => SCANS.test(path))?.path.replace(/[^/]*$/, "") ?? "";
    const unpacked = entries.map(async ({ path, isEncrypted, method, packed, size, offset }) => {
      if (isEncrypted) throw refused(`${path} is encrypted. Unpack it with its password, and choose its files`);
      if (method !== STORED && method !== DEFLATED) throw refused(`${path} is packed by method ${method}. Pack it as an ordinary ZIP`);
      word(offset, FILE);
      const from = offset + 30 + view.getUint16(offset + 26, true) + view.getUint16(offset + 28, true);
      const content = await inflated(bytes.slice(from, from + packed), method, size);
      return /** @type {[string, Uint8Array]} */ ([path.startsWith(folder) ? path.slice(folder.length) : path.replace(/.*\//, ""), content]);
    });
    return await Promise.all(unpacked);
  } catch (error) {
    if (error instanceof RangeError || error instanceof TypeError) throw refused("it was cut short or is damaged. Copy it again from where it came", error);
    throw error;
  }
}

/** The content of a file; not more than the `size` that its archive announces. @param {Uint8Array<ArrayBuffer>} packed @param {number} method @param {number} size */
async function inflated(packed, method, size) {
  const [content, stream] = [new Uint8Array(size), new Blob([packed]).stream()];
  const reader = (method === DEFLATED ? stream.pipeThrough(new DecompressionStream("deflate-raw")) : stream).getReader();
  let length = 0;
  for (let chunk = await reader.read(); !chunk.done; chunk = await reader.read()) {
    content.set(chunk.value, length);
    length += chunk.value.length;
  }
  if (length !== size) throw new RangeError(`${length} bytes of ${size}`);
  return content;
}
