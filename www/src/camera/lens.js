// How lenses bend rays: OpenCV's two models, as the Rust side's `Lens` has them.

/** @import { Camera } from "./intrinsics.js" */

/** A camera's lens. Without coefficients it bends nothing. @typedef {Pick<Camera, "distortion" | "fisheye">} Lens */

/** Squared length of the longest rays (x, y, 1) that a polynomial is checked for: 89.4 degrees from the axis. */
const LONGEST_RAY_SQUARED = 1e4;
/** Angle from the axis of the outermost rays that are an (x, y, 1), radians. */
const OUTERMOST = Math.PI / 2 - 1e-9;
/** Where a place is met, focal lengths. */
const MET = 1e-13;
/** What stands for no end in shaders, focal lengths. */
const ENDLESS = 1e6;

/**
 * GLSL of the same, for vertex and fragment shaders: `vec2 distorted(vec2 ray)` says where the lens brings the ray (x, y, 1), and
 * `vec2 undistorted(vec2 place)` is its inverse, both in focal lengths from the principal point. The uniform `u_lens` takes
 * {@link lensUniform}.
 */
export const LENS_GLSL = `
uniform float u_lens[7];           // k1, k2, p1, p2, k3 or a fisheye's k1, k2, k3, k4, 0; 1 of a fisheye, -1 of none; longest ray
/* Where a ray of length r lands, of a fisheye one at the angle r, and the derivative; what is tangential left aside. */
vec2 lensRadius(float r) {
  float r2 = r * r;
  if (u_lens[5] > 0.5)
    return vec2(
      r * (1.0 + r2 * (u_lens[0] + r2 * (u_lens[1] + r2 * (u_lens[2] + r2 * u_lens[3])))),
      1.0 + r2 * (3.0 * u_lens[0] + r2 * (5.0 * u_lens[1] + r2 * (7.0 * u_lens[2] + r2 * 9.0 * u_lens[3]))));
  return vec2(
    r * (1.0 + r2 * (u_lens[0] + r2 * (u_lens[1] + r2 * u_lens[4]))),
    1.0 + r2 * (3.0 * u_lens[0] + r2 * (5.0 * u_lens[1] + r2 * 7.0 * u_lens[4])));
}
vec2 distorted(vec2 ray) {
  float r = length(ray);
  if (u_lens[5] < 0.0 || r < 1e-7) return ray;
  float within = min(r, u_lens[6]);
  float radius = lensRadius(u_lens[5] > 0.5 ? atan(within) : within).x + r - within;
  vec2 place = ray * (radius / r);
  if (u_lens[5] > 0.5) return place;
  vec2 p = ray * (within / r);
  return place + vec2(
    2.0 * u_lens[2] * p.x * p.y + u_lens[3] * (dot(p, p) + 2.0 * p.x * p.x),
    u_lens[2] * (dot(p, p) + 2.0 * p.y * p.y) + 2.0 * u_lens[3] * p.x * p.y);
}
vec2 undistorted(vec2 place) {
  float radius = length(place);
  if (u_lens[5] < 0.0 || radius < 1e-7) return place;
  bool isFisheye = u_lens[5] > 0.5;
  float last = isFisheye ? min(atan(u_lens[6]), 1.5607) : u_lens[6];
  float r = min(radius, last);
  for (int i = 0; i < 8; i++) {
    vec2 at = lensRadius(r);
    r = clamp(r + (radius - at.x) / max(at.y, 0.02), 0.0, last);
  }
  vec2 ray = place * ((isFisheye ? tan(r) : r) / radius);
  // What is tangential, and what the shader's tangent is off.
  for (int i = 0; i < 3; i++) {
    float l = max(length(ray), 1e-7);
    vec2 at = lensRadius(isFisheye ? atan(l) : l), missing = place - distorted(ray), direction = ray / l;
    float across = at.x / l, along = max(at.y, 0.02) / (isFisheye ? 1.0 + l * l : 1.0);
    ray += missing / across + direction * dot(direction, missing) * (1.0 / along - 1.0 / across);
    ray *= min(1.0, u_lens[6] / max(length(ray), 1e-7));
  }
  return ray;
}`;

/**
 * What {@link LENS_GLSL} wants to know of a lens, for `gl.uniform1fv` or the value of a uniform of three.js.
 *
 * @param {Lens} lens a `Camera` is one
 * @returns {number[]} seven numbers
 */
export function lensUniform(lens) {
  const coefficients = lens.fisheye ? [...lens.fisheye, 0] : (lens.distortion ?? [0, 0, 0, 0, 0]);
  const kind = lens.fisheye ? 1 : isPinhole(lens) ? -1 : 0;
  return [...coefficients, kind, Math.min(reachOf(lens), ENDLESS)];
}

/**
 * Where a lens brings the ray (x, y, 1): focal lengths from the principal point. Beyond the angle at which its model folds back
 * places go on outwards, one for each ray: real lenses do not fold, and nothing is drawn twice.
 *
 * @param {Lens} lens
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export function distorted(lens, x, y) {
  const length = Math.hypot(x, y);
  if (length === 0 || isPinhole(lens)) return [x, y];
  const within = Math.min(length, reachOf(lens));
  const [radius] = radiusAt(lens, lens.fisheye ? Math.atan(within) : within);
  const factor = (radius + length - within) / length;
  if (lens.fisheye || !lens.distortion) return [x * factor, y * factor];
  const [, , p1, p2] = lens.distortion;
  const [px, py] = [(x * within) / length, (y * within) / length];
  const r2 = px * px + py * py;
  return [x * factor + 2 * p1 * px * py + p2 * (r2 + 2 * px * px), y * factor + p1 * (r2 + 2 * py * py) + 2 * p2 * px * py];
}

/**
 * The ray (x, y, 1) that a lens brings to a place, focal lengths from the principal point: the inverse of {@link distorted}. Of a place
 * that no ray has, beyond the fold, the outermost ray in its direction.
 *
 * @param {Lens} lens
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export function undistorted(lens, x, y) {
  const radius = Math.hypot(x, y);
  if (radius === 0 || isPinhole(lens)) return [x, y];
  const reach = reachOf(lens);
  const end = lens.fisheye ? Math.min(Math.atan(reach), OUTERMOST) : Math.min(reach, Math.sqrt(LONGEST_RAY_SQUARED));
  const length = increasingInverse((r) => radiusAt(lens, r), radius, end);
  const factor = (lens.fisheye ? Math.tan(length) : length) / radius;
  let ray = /** @type {[number, number]} */ ([x * factor, y * factor]);
  // What is tangential, by Newton's method with the derivative of the rest.
  for (let i = 0; i < 50 && !lens.fisheye; i++) {
    const at = distorted(lens, ...ray);
    const missing = [x - at[0], y - at[1]];
    const r = Math.hypot(...ray);
    const [radiusThere, along] = radiusAt(lens, r);
    if (Math.hypot(...missing) < MET || r === 0 || along <= 0) break;
    const [across, direction] = [radiusThere / r, [ray[0] / r, ray[1] / r]];
    const outwards = (direction[0] * missing[0] + direction[1] * missing[1]) * (1 / along - 1 / across);
    ray = [ray[0] + missing[0] / across + direction[0] * outwards, ray[1] + missing[1] / across + direction[1] * outwards];
    const most = Math.min(1, reach / Math.hypot(...ray));
    ray = [ray[0] * most, ray[1] * most];
  }
  return ray;
}

/** @param {Lens} lens */
export function isPinhole({ fisheye, distortion }) {
  return !fisheye && !distortion?.some((k) => k !== 0);
}

/**
 * Where a ray of length `r` lands, of a fisheye one at the angle `r` from the axis, and the derivative; what is tangential left aside.
 *
 * @param {Lens} lens
 * @param {number} r
 * @returns {[number, number]}
 */
function radiusAt(lens, r) {
  const r2 = r * r;
  const slope = slopeOf(lens).reduceRight((sum, c) => sum * r2 + c, 0);
  const radius = slopeOf(lens).reduceRight((sum, c, power) => sum * r2 + c / (2 * power + 1), 0);
  return [r * radius, slope];
}

/**
 * How much farther out places are for rays a little longer, as a polynomial in the squared length (of a fisheye: angle), lowest power
 * first.
 *
 * @param {Lens} lens
 */
function slopeOf({ fisheye, distortion }) {
  const [k1, k2, , , k3] = distortion ?? [0, 0, 0, 0, 0];
  return [1, ...(fisheye ?? [k1, k2, k3]).map((k, i) => (2 * i + 3) * k)];
}

/** Of the lens that was asked for last: places are asked for by the thousand. */
let known = { slope: [1], isFisheye: false, reach: Infinity };

/**
 * Length of the longest ray (x, y, 1) up to which longer rays land farther out.
 *
 * @param {Lens} lens
 */
function reachOf(lens) {
  const [slope, isFisheye] = [slopeOf(lens), lens.fisheye !== undefined];
  if (known.isFisheye === isFisheye && known.slope.length === slope.length && slope.every((c, i) => c === known.slope[i]))
    return known.reach;
  const [square] = rootsOf(slope, isFisheye ? OUTERMOST ** 2 : LONGEST_RAY_SQUARED);
  const longest = square === undefined ? Infinity : Math.sqrt(square);
  known = { slope, isFisheye, reach: isFisheye && square !== undefined ? Math.tan(longest) : longest };
  return known.reach;
}

/**
 * The roots of odd order of a polynomial (lowest power first) in (0, `end`], ascending: between two neighbouring roots of its
 * derivative there is at most one.
 *
 * @param {number[]} polynomial
 * @param {number} end
 * @returns {number[]}
 */
function rootsOf(polynomial, end) {
  if (polynomial.length < 2) return [];
  const value = (/** @type {number} */ x) => polynomial.reduceRight((sum, c) => sum * x + c, 0);
  const derivative = polynomial.slice(1).map((c, i) => (i + 1) * c);
  const borders = [0, ...rootsOf(derivative, end), end];
  return borders.slice(1).flatMap((border, i) => {
    let [low, high] = [borders[i], border];
    const rising = value(low) < value(high);
    if (value(low) < 0 === value(high) < 0) return [];
    for (let n = 0; n < 200; n++) {
      const middle = (low + high) / 2;
      if (value(middle) < 0 === rising) low = middle;
      else high = middle;
    }
    return [low];
  });
}

/**
 * The place in [0, `end`] where an increasing function (0 at 0) is `value`; `end` where it stays below. Newton's method, and halving
 * where that leaves the bracket.
 *
 * @param {(place: number) => [number, number]} at value and derivative
 * @param {number} value
 * @param {number} end
 */
function increasingInverse(at, value, end) {
  if (at(end)[0] <= value) return end;
  let [low, high, place] = [0, end, Math.min(value, end)];
  for (let i = 0; i < 100; i++) {
    const [actual, slope] = at(place);
    if (Math.abs(actual - value) < MET) break;
    if (actual < value) low = place;
    else high = place;
    const newton = place + (value - actual) / slope;
    place = newton > low && newton < high ? newton : (low + high) / 2;
  }
  return place;
}
