// Photographs as phones write them: JPEG files that tell of their camera.

/**
 * The picture as a JPEG file, made in a page. Stored turned, as the sensor lay, where `orientation` is 6.
 *
 * @param {import("playwright-core").Page} page
 * @param {{ width: number, height: number, rgb: Uint8Array }} picture
 * @param {{ equivalentMm?: number, orientation?: 1 | 6 }} [exif] what the file tells: focal length as of a 35 mm camera, and how the picture
 *   is to be turned
 */
export async function photograph(page, { width, height, rgb }, { equivalentMm, orientation = 1 } = {}) {
  const jpeg = await page.evaluate(
    async ([base64, width, height, isTurned]) => {
      const rgb = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const rgba = new Uint8ClampedArray(4 * width * height).fill(255);
      for (let i = 0; i < width * height; i++) rgba.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
      const upright = new OffscreenCanvas(width, height);
      upright.getContext("2d").putImageData(new ImageData(rgba, width, height), 0, 0);
      const stored = isTurned ? new OffscreenCanvas(height, width) : upright;
      if (isTurned) {
        const context = stored.getContext("2d");
        context.translate(0, width);
        context.rotate(-Math.PI / 2);
        context.drawImage(upright, 0, 0);
      }
      const blob = await stored.convertToBlob({ type: "image/jpeg", quality: 0.95 });
      return [...new Uint8Array(await blob.arrayBuffer())];
    },
    [Buffer.from(rgb).toString("base64"), width, height, orientation === 6],
  );
  const file = Buffer.from(jpeg);
  return equivalentMm === undefined ? file : Buffer.concat([file.subarray(0, 2), exifSegment(equivalentMm, orientation), file.subarray(2)]);
}

/** The segment of a JPEG file with Orientation and FocalLengthIn35mmFilm. */
function exifSegment(equivalentMm, orientation) {
  const [SHORT, LONG] = [3, 4];
  const entry = (tag, type, value) => {
    const bytes = Buffer.alloc(12);
    bytes.writeUInt16BE(tag, 0);
    bytes.writeUInt16BE(type, 2);
    bytes.writeUInt32BE(1, 4);
    if (type === SHORT) bytes.writeUInt16BE(value, 8);
    else bytes.writeUInt32BE(value, 8);
    return bytes;
  };
  const folder = (...entries) => Buffer.concat([Buffer.from([0, entries.length]), ...entries, Buffer.alloc(4)]);
  const header = Buffer.from([0x4d, 0x4d, 0, 42, 0, 0, 0, 8]);
  const first = (at) => folder(entry(0x0112, SHORT, orientation), entry(0x8769, LONG, at));
  const exif = folder(entry(0xa405, SHORT, equivalentMm));
  const body = Buffer.concat([Buffer.from("Exif\0\0"), header, first(header.length + first(0).length), exif]);
  const length = Buffer.alloc(2);
  length.writeUInt16BE(body.length + 2);
  return Buffer.concat([Buffer.from([0xff, 0xe1]), length, body]);
}
