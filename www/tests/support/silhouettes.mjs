// What of solids and sheets a pinhole camera sees, by the textbook.

/**
 * The depth of triangles in each pixel, mm; infinite beside them.
 *
 * @param {number[][]} corners (x, y, z) each, camera frame, mm; three for a triangle
 * @param {{ width: number, height: number, fx: number, fy: number, cx: number, cy: number }} camera
 */
export function depthsOf(corners, { width, height, fx, fy, cx, cy }) {
  const depths = new Float64Array(width * height).fill(Infinity);
  for (let i = 0; i < corners.length; i += 3) {
    const triangle = corners.slice(i, i + 3);
    const [a, b, c] = triangle.map(([x, y, z]) => [(fx * x) / z + cx, (fy * y) / z + cy]);
    const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (area === 0) continue;
    const range = (k, most) => [Math.max(0, Math.floor(Math.min(a[k], b[k], c[k]))), Math.min(most - 1, Math.floor(Math.max(a[k], b[k], c[k])))];
    const [[left, right], [top, bottom]] = [range(0, width), range(1, height)];
    for (let y = top; y <= bottom; y++) {
      for (let x = left; x <= right; x++) {
        const [px, py] = [x + 0.5 - a[0], y + 0.5 - a[1]];
        const [atB, atC] = [(px * (c[1] - a[1]) - py * (c[0] - a[0])) / area, ((b[0] - a[0]) * py - (b[1] - a[1]) * px) / area];
        if (Math.min(atB, atC, 1 - atB - atC) < 0) continue;
        const depth = 1 / ((1 - atB - atC) / triangle[0][2] + atB / triangle[1][2] + atC / triangle[2][2]);
        depths[y * width + x] = Math.min(depths[y * width + x], depth);
      }
    }
  }
  return depths;
}

/** The corners of a solid's triangles, (x, y, z) each. @param {{ geometries: import("three").BufferGeometry[] }} solids @returns {number[][]} */
export function cornersOf({ geometries }) {
  return geometries.flatMap(({ attributes: { position } }) => Array.from({ length: position.count }, (_, i) => [position.getX(i), position.getY(i), position.getZ(i)]));
}

/** The pixels of a mask with none of the other kind within `reach` pixels. @param {boolean[]} mask */
export function inner(mask, { width, height }, reach) {
  return [...mask.keys()].filter((i) => {
    if (!mask[i]) return false;
    const [x, y] = [i % width, Math.floor(i / width)];
    if (x < reach || y < reach || x >= width - reach || y >= height - reach) return false;
    for (let dy = -reach; dy <= reach; dy++) for (let dx = -reach; dx <= reach; dx++) if (!mask[i + dy * width + dx]) return false;
    return true;
  });
}
