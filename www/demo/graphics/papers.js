// The papers that the poster can be turned into: colours as functions of the position on the sheet and of time.

/** @typedef {"aurora" | "ink" | "squares"} Paper */

/**
 * GLSL: for each paper a function of its name, `vec3 auroraPaper(vec2 mm, float pixelMm, vec2 sizeMm, float seconds)`: linear light, `mm`
 * from the sheet's top left (detail finer than a pixel, which is `pixelMm` wide on the sheet, fades out).
 */
export const PAPERS_GLSL = `
float hash(vec2 p) {
  uvec2 q = uvec2(ivec2(p)) * uvec2(1597334673u, 3812015801u);
  uint n = (q.x ^ q.y) * 1597334673u;
  n ^= n >> 15;
  return float(n * 2246822519u >> 8) / 16777216.0;
}

float valueNoise(vec2 p) {
  vec2 cell = floor(p);
  vec2 f = p - cell;
  f = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
  return mix(
    mix(hash(cell), hash(cell + vec2(1, 0)), f.x),
    mix(hash(cell + vec2(0, 1)), hash(cell + vec2(1, 1)), f.x), f.y);
}

float fractal(vec2 p) {
  float sum = 0.0;
  float weight = 0.5;
  for (int octave = 0; octave < 4; octave++) {
    sum += weight * valueNoise(p);
    p = mat2(1.6, 1.2, -1.2, 1.6) * p + 7.3;
    weight *= 0.5;
  }
  return sum;
}

/* A night sky: curtains of light that hang from folded lines and fade upwards, stars behind, hills before. */
vec3 auroraPaper(vec2 mm, float pixelMm, vec2 sizeMm, float seconds) {
  vec2 p = mm / sizeMm.y;
  float height = 1.0 - p.y;
  vec3 color = mix(vec3(0.008, 0.022, 0.065), vec3(0.002, 0.003, 0.02), height);
  vec3 light = vec3(0.0);
  for (int curtain = 0; curtain < 3; curtain++) {
    float k = float(curtain);
    float drift = seconds * (0.05 + 0.02 * k);
    float fold = fractal(vec2(p.x * (1.3 + 0.5 * k) + drift + 11.0 * k, 0.07 * seconds + 5.0 * k));
    float foot = 0.16 + 0.19 * k + 0.4 * fold;
    float above = height - foot;
    float rays = valueNoise(vec2(p.x * (15.0 + 6.0 * k) + 7.0 * fold + 3.0 * drift, seconds * 0.3 + k));
    float glow = above > 0.0 ? exp(-above * (3.2 + 2.4 * rays + k)) : exp(above * 36.0);
    vec3 tone = mix(vec3(0.05, 0.95, 0.38), vec3(0.36, 0.06, 0.95), smoothstep(0.0, 0.42, above + 0.05 * k));
    light += tone * glow * (0.3 + 0.7 * rays) * (1.0 - 0.2 * k);
  }
  color += light * 0.9;
  vec2 starCell = floor(mm / 5.0);
  vec2 starAt = (vec2(hash(starCell), hash(starCell + 31.0)) * 0.7 + 0.15) * 5.0;
  float magnitude = hash(starCell + 57.0);
  float size = 0.2 + 0.5 * magnitude * magnitude * magnitude;
  float distanceMm = length(mm - starCell * 5.0 - starAt);
  float twinkle = 0.65 + 0.35 * sin(seconds * (1.0 + 2.0 * hash(starCell + 91.0)) + 40.0 * hash(starCell));
  float star = smoothstep(size + pixelMm, 0.0, distanceMm) * step(0.72, hash(starCell + 17.0)) * twinkle * min(1.0, size / pixelMm);
  color += star * vec3(0.9, 0.95, 1.0) / (1.0 + 6.0 * light.g);
  float far = 0.13 + 0.13 * fractal(vec2(p.x * 2.6 + 3.0, 1.5));
  float near = 0.03 + 0.14 * fractal(vec2(p.x * 4.2 + 40.0, 8.5));
  float soft = pixelMm / sizeMm.y;
  color = mix(color, vec3(0.004, 0.022, 0.038) + 0.05 * light, smoothstep(soft, -soft, height - far));
  return mix(color, vec3(0.001, 0.004, 0.01), smoothstep(soft, -soft, height - near));
}

/* Ink floated on water, as in suminagashi: rings about drops, dragged by a slow current. */
vec3 inkPaper(vec2 mm, float pixelMm, vec2 sizeMm, float seconds) {
  vec2 p = mm / sizeMm.y;
  vec2 drag = vec2(fractal(p * 1.7 + 0.05 * seconds), fractal(p * 1.7 + vec2(9.2, 3.1) - 0.04 * seconds)) - 0.47;
  p += 0.55 * drag;
  vec2 drops[3] = vec2[3](vec2(0.42, 0.38), vec2(1.06, 0.62), vec2(0.78, 0.12));
  float d = 10.0;
  for (int i = 0; i < 3; i++) d = min(d, length(p - drops[i]) * (1.0 + 0.18 * float(i)));
  float phase = d * 15.0 - seconds * 0.25 + 1.6 * fractal(p * 3.0);
  float slope = 24.0 * pixelMm / sizeMm.y;
  float ring = abs(fract(phase) - 0.5) * 2.0;
  float width = 0.34 + 0.3 * fractal(p * 2.3 + 4.0);
  float ink = 1.0 - smoothstep(width - 2.0 * slope, width + 2.0 * slope + 0.08, ring);
  ink *= 0.8 + 0.2 * fractal(p * 6.0 + 2.0);
  ink *= 1.0 - smoothstep(0.3, 0.9, slope);
  float band = mod(floor(phase), 5.0);
  vec3 tone = band < 0.5 ? vec3(0.55, 0.055, 0.03) : mix(vec3(0.008, 0.016, 0.07), vec3(0.01, 0.09, 0.16), band / 4.0);
  vec3 washi = vec3(0.86, 0.81, 0.71) * (0.96 + 0.08 * valueNoise(mm * 0.9));
  return mix(washi, tone, ink * 0.97);
}

/* Squares of 15 mm with a ruler's lines every 5 mm: shows at a glance whether lengths are kept. */
vec3 squaresPaper(vec2 mm, float pixelMm, vec2 sizeMm, float seconds) {
  vec2 square = (mm - 0.5 * sizeMm) / 15.0;
  vec2 edge = (abs(fract(square * 0.5) - 0.5) - 0.25) * 30.0;
  vec2 side = clamp(edge / pixelMm, -1.0, 1.0);
  float parity = 0.5 + 0.5 * side.x * side.y;
  vec2 p = mm / sizeMm;
  float wave = 0.5 + 0.5 * sin(6.2832 * (p.x * 0.7 + p.y * 0.45) + seconds * 0.6);
  vec3 dark = mix(vec3(0.012, 0.07, 0.13), vec3(0.02, 0.20, 0.22), wave);
  vec3 light = mix(vec3(0.95, 0.86, 0.70), vec3(0.95, 0.56, 0.34), wave * 0.75);
  vec3 color = mix(dark, light, parity);
  vec2 line = abs(fract((mm - 0.5 * sizeMm) / 5.0 + 0.5) - 0.5) * 5.0;
  vec2 stroke = (1.0 - smoothstep(vec2(0.12), vec2(0.12 + pixelMm), line)) * min(1.0, 0.5 / pixelMm);
  color = mix(color, vec3(1.0), 0.13 * max(stroke.x, stroke.y));
  vec2 fromCentre = abs(mm - 0.5 * sizeMm);
  float cross = min(fromCentre.x, fromCentre.y);
  float mark = (1.0 - smoothstep(0.5, 0.5 + pixelMm, cross)) * step(length(fromCentre), 12.0);
  return mix(color, vec3(0.75, 0.08, 0.03), mark);
}
`;
