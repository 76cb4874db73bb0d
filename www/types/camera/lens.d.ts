import type { Camera } from "./intrinsics.js";
export type Lens = Pick<Camera, "distortion" | "fisheye">;
/**
 * GLSL of the same, for vertex and fragment shaders: `vec2 distorted(vec2 ray)` says where the lens brings the ray (x, y, 1), and
 * `vec2 undistorted(vec2 place)` is its inverse, both in focal lengths from the principal point. The uniform `u_lens` takes
 * {@link lensUniform}.
 */
export declare const LENS_GLSL = "\nuniform float u_lens[7];           // k1, k2, p1, p2, k3 or a fisheye's k1, k2, k3, k4, 0; 1 of a fisheye, -1 of none; longest ray\n/* Where a ray of length r lands, of a fisheye one at the angle r, and the derivative; what is tangential left aside. */\nvec2 lensRadius(float r) {\n  float r2 = r * r;\n  if (u_lens[5] > 0.5)\n    return vec2(\n      r * (1.0 + r2 * (u_lens[0] + r2 * (u_lens[1] + r2 * (u_lens[2] + r2 * u_lens[3])))),\n      1.0 + r2 * (3.0 * u_lens[0] + r2 * (5.0 * u_lens[1] + r2 * (7.0 * u_lens[2] + r2 * 9.0 * u_lens[3]))));\n  return vec2(\n    r * (1.0 + r2 * (u_lens[0] + r2 * (u_lens[1] + r2 * u_lens[4]))),\n    1.0 + r2 * (3.0 * u_lens[0] + r2 * (5.0 * u_lens[1] + r2 * 7.0 * u_lens[4])));\n}\nvec2 distorted(vec2 ray) {\n  float r = length(ray);\n  if (u_lens[5] < 0.0 || r < 1e-7) return ray;\n  float within = min(r, u_lens[6]);\n  float radius = lensRadius(u_lens[5] > 0.5 ? atan(within) : within).x + r - within;\n  vec2 place = ray * (radius / r);\n  if (u_lens[5] > 0.5) return place;\n  vec2 p = ray * (within / r);\n  return place + vec2(\n    2.0 * u_lens[2] * p.x * p.y + u_lens[3] * (dot(p, p) + 2.0 * p.x * p.x),\n    u_lens[2] * (dot(p, p) + 2.0 * p.y * p.y) + 2.0 * u_lens[3] * p.x * p.y);\n}\nvec2 undistorted(vec2 place) {\n  float radius = length(place);\n  if (u_lens[5] < 0.0 || radius < 1e-7) return place;\n  bool isFisheye = u_lens[5] > 0.5;\n  float last = isFisheye ? min(atan(u_lens[6]), 1.5607) : u_lens[6];\n  float r = min(radius, last);\n  for (int i = 0; i < 8; i++) {\n    vec2 at = lensRadius(r);\n    r = clamp(r + (radius - at.x) / max(at.y, 0.02), 0.0, last);\n  }\n  vec2 ray = place * ((isFisheye ? tan(r) : r) / radius);\n  // What is tangential, and what the shader's tangent is off.\n  for (int i = 0; i < 3; i++) {\n    float l = max(length(ray), 1e-7);\n    vec2 at = lensRadius(isFisheye ? atan(l) : l), missing = place - distorted(ray), direction = ray / l;\n    float across = at.x / l, along = max(at.y, 0.02) / (isFisheye ? 1.0 + l * l : 1.0);\n    ray += missing / across + direction * dot(direction, missing) * (1.0 / along - 1.0 / across);\n    ray *= min(1.0, u_lens[6] / max(length(ray), 1e-7));\n  }\n  return ray;\n}";
/**
 * What {@link LENS_GLSL} wants to know of a lens, for `gl.uniform1fv` or the value of a uniform of three.js.
 *
 * @param {Lens} lens a `Camera` is one
 * @returns {number[]} seven numbers
 */
export declare function lensUniform(lens: Lens): number[];
/**
 * Where a lens brings the ray (x, y, 1): focal lengths from the principal point. Beyond the angle at which its model folds back
 * places go on outwards, one for each ray: real lenses do not fold, and nothing is drawn twice.
 *
 * @param {Lens} lens
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export declare function distorted(lens: Lens, x: number, y: number): [number, number];
/**
 * The ray (x, y, 1) that a lens brings to a place, focal lengths from the principal point: the inverse of {@link distorted}. Of a place
 * that no ray has, beyond the fold, the outermost ray in its direction.
 *
 * @param {Lens} lens
 * @param {number} x
 * @param {number} y
 * @returns {[number, number]}
 */
export declare function undistorted(lens: Lens, x: number, y: number): [number, number];
/** @param {Lens} lens */
export declare function isPinhole({ fisheye, distortion }: Lens): boolean;
