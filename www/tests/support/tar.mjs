// Tar archives, as datasets are kept in.

/**
 * @param {Buffer} archive
 * @returns {Map<string, Buffer>} content by name
 */
export function untar(archive) {
  const files = new Map();
  const text = (from, to) => archive.toString("latin1", from, to).replace(/\0.*$/s, "");
  for (let at = 0; at + 512 <= archive.length && archive[at] !== 0;) {
    const size = Number.parseInt(text(at + 124, at + 136), 8);
    const name = [text(at + 345, at + 500), text(at, at + 100)].filter(Boolean).join("/");
    files.set(name, archive.subarray(at + 512, at + 512 + size));
    at += 512 + Math.ceil(size / 512) * 512;
  }
  return files;
}
