//! The compact network's arithmetic between its convolutions, as shaders: the same as the processor's in `cells.rs`, `depths.rs`
//! and the executor. A cell's quads hold u, v and d side by side, or x, y, d and z.

use super::cells::{NEIGHBOURS, PIXELS_PER_CELL};
use super::depths::{
    COVARIANCE_DAMPING, DEPARTURE_GAIN, HALF_SUPPORT, LARGEST_DEPARTURE, MEASURED, MOMENTS, NORMALISED, SLOPE_DAMPING,
    UNIT_MM,
};
use super::patches::PATCH;
use crate::config::NetworkConfig;

// The shaders read a row of a patch, and the depths measured of a cell, as one quad.
const _: () = assert!(PATCH == 4 && MEASURED == 4 && MOMENTS == 24);

/// Constants of a network that shaders share.
pub(super) fn constants(config: &NetworkConfig) -> String {
    let [cx, cy] = config.principal_point;
    let [width, height] = config.template_size_mm;
    let range = config.depth_range;
    let [least, most] = NORMALISED;
    [
        ("focal", config.focal),
        ("cx", cx),
        ("cy", cy),
        ("size_u_mm", width),
        ("size_v_mm", height),
        // z is measured as x is; a sheet has none.
        ("size_z_mm", f64::from(u8::from(config.has_rest_positions())) * width),
        ("near_mm", range.near_mm),
        ("span", (range.far_mm / range.near_mm).ln()),
        ("unit_mm", UNIT_MM),
        ("least", f64::from(least)),
        ("most", f64::from(most)),
        ("covariance_damping", f64::from(COVARIANCE_DAMPING)),
        ("slope_damping", f64::from(SLOPE_DAMPING)),
        ("half_support", f64::from(HALF_SUPPORT)),
        ("departure_gain", f64::from(DEPARTURE_GAIN)),
        ("largest_departure", f64::from(LARGEST_DEPARTURE)),
    ]
    .iter()
    .map(|(name, value)| format!("const {name}: f32 = {:?};\n", *value as f32))
    .chain([format!(
        "const moment_count = {MOMENTS}u; const neighbours = {NEIGHBOURS}u; const cell = {PIXELS_PER_CELL}.0;\n"
    )])
    .collect()
}

/// Patches of 4 x 4 pixels, the channels of the image one after another, values -2..=2; black where the image is padded.
pub(super) const PATCHES: &str = "
let q = index / size.patches; let patch_index = index % size.patches;
let row = patch_index / size.across * 4u + q % 4u; let left = patch_index % size.across * 4u;
var value = vec4f(-2.0);
for (var k = 0u; k < 4u; k++) {
    let column = left + k;
    if row < size.height && column < size.width {
        let at = (row * size.width + column) * 3u + q / 4u;
        value[k] = f32((image[at / 4u] >> (8u * (at % 4u))) & 255u) * (4.0 / 255.0) - 2.0;
    }
}
out[index] = value;";

pub(super) const POSITION_FUNCTIONS: &str = "
fn logit(at: u32, k: u32) -> f32 { return bins[((k / 4u) * size.count + at) * 4u + k % 4u]; }
fn expected(at: u32, first: u32, count: u32) -> f32 {
    var best = 0u; var most = logit(at, first);
    for (var k = 1u; k < count; k++) {
        let value = logit(at, first + k);
        if value > most { best = k; most = value; }
    }
    var sum = 0.0; var weights = 0.0;
    let end = min(best + neighbours + 1u, count);
    for (var k = max(best, neighbours) - neighbours; k < end; k++) {
        let weight = exp(logit(at, first + k) - most);
        sum += weight * f32(k);
        weights += weight;
    }
    return sum / weights / f32(count - 1u);
}";

/// The coordinates of bins.
pub(super) const POSITIONS: &str = "
let first_v = size.bins_u; let first_d = size.bins_u + size.bins_v;
var position = vec4f(
    expected(index, 0u, size.bins_u), expected(index, first_v, size.bins_v), expected(index, first_d, size.bins_d), 0.0);
if size.bins_z > 0u { position.w = expected(index, first_d + size.bins_d, size.bins_z); }
out[index] = position;";

pub(super) const CELL_FUNCTIONS: &str = "
// A sample of a signal of `length` cells up-sampled two times: between which cells it lies.
struct Between { low: u32, high: u32, fraction: f32 }
fn between(index: u32, length: u32) -> Between {
    let at = clamp((f32(index) + 0.5) / 2.0 - 0.5, 0.0, f32(length - 1u));
    let low = u32(at);
    return Between(low, low + select(0u, 1u, at > f32(low)), at - f32(low));
}
fn along(row: u32, column: Between) -> vec4f {
    let a = coarse[row * size.columns / 2u + column.low];
    let b = coarse[row * size.columns / 2u + column.high];
    return a + (b - a) * column.fraction;
}";

pub(super) const MOMENT_FUNCTION: &str = "
fn put(moment: u32, row: u32, column: u32, value: f32) {
    moments[((row / 4u * moment_count + moment) * size.columns + column) * 4u + row % 4u] = value;
}";

/// The coordinates of cells from bins and offsets, and how much the mask shows of each.
pub(super) const CELLS: &str = "
let row = index / size.columns; let column = index % size.columns;
let r = between(row, size.rows / 2u); let c = between(column, size.columns / 2u);
let a = along(r.low, c); let b = along(r.high, c);
let position = a + (b - a) * r.fraction + offset[index];
var sum = 0.0;
for (var q = 0u; q < 4u; q++) {
    for (var k = 0u; k < 4u; k++) {
        let place = (2u * row + k / 2u) * 2u * size.columns + 2u * column + k % 2u;
        sum += dot(mask[q * 4u * size.count + place], vec4f(1.0));
    }
}
let seen = 1.0 / (1.0 + exp(-sum / 64.0));
out[index] = position;";

/// Moments of cells: how much a cell counts, and 23 products times that.
pub(super) const MOMENTS_OF_CELLS: &str = "
let x = ((f32(column) + 0.5) * cell - cx) / focal; let y = ((f32(row) + 0.5) * cell - cy) / focal;
let u = (position.x - 0.5) * size_u_mm / unit_mm; let v = (position.y - 0.5) * size_v_mm / unit_mm;
var powers = array<f32, 6>(1.0, u, v, u * u, u * v, v * v);
put(0u, row, column, seen);
for (var k = 0u; k < 6u; k++) {
    put(1u + k, row, column, powers[k] * seen);
    put(7u + k, row, column, powers[k] * x * seen);
    put(13u + k, row, column, powers[k] * y * seen);
}
for (var k = 1u; k < 6u; k++) { put(18u + k, row, column, (x * x + y * y) * powers[k] * seen); }";

/// What the windows down said, turned for the windows across: a quad is of four columns. Batches are the windows' reaches.
pub(super) const TURN: &str = "
let places = moment_count * size.rows;
let q = index / places; let moment = index % places / size.rows; let row = index % places % size.rows;
let source = batch * size.rows + row;
var value = vec4f();
for (var k = 0u; k < 4u; k++) {
    let column = min(4u * q + k, size.columns - 1u);
    value[k] = down[((source / 4u * moment_count + moment) * size.columns + column) * 4u + source % 4u];
}
if batch == 0u { narrow[index] = value; } else { wide[index] = value; }";

pub(super) const MEASURE_FUNCTIONS: &str = "
fn normalised(depth_mm: f32) -> f32 { return clamp(log(depth_mm / near_mm) / span, least, most); }

// Depths from the smallest and the largest singular value of the registration's Jacobian.
fn isometric(row: u32, column: u32) -> vec2f {
    let left = max(column, 1u) - 1u; let right = min(column + 1u, size.columns - 1u);
    let above = max(row, 1u) - 1u; let below = min(row + 1u, size.rows - 1u);
    let mm = vec3f(size_u_mm, size_v_mm, size_z_mm);
    let x = (found[row * size.columns + right].xyw * mm - found[row * size.columns + left].xyw * mm) / (2.0 * cell);
    let y = (found[below * size.columns + column].xyw * mm - found[above * size.columns + column].xyw * mm) / (2.0 * cell);
    let a = dot(x, x); let b = dot(y, y); let c = dot(x, y);
    let half_sum = (a + b) / 2.0; let half = (a - b) / 2.0;
    let half_gap = sqrt(half * half + c * c);
    return vec2f(normalised(sqrt(max(half_sum - half_gap, 1e-6)) * focal), normalised(sqrt(max(half_sum + half_gap, 1e-6)) * focal));
}

var<private> m: array<f32, moment_count>;

struct Axis { means: vec3f, covariances: mat3x2f, slopes: mat3x2f }
fn axis(first: u32, p: vec2f, inverse: mat2x2f) -> Axis {
    let means = vec3f(m[first], m[first + 1u], m[first + 2u]);
    let covariances = mat3x2f(
        means.yz - means.x * p,
        vec2f(m[first + 3u], m[first + 4u]) - means.y * p,
        vec2f(m[first + 4u], m[first + 5u]) - means.z * p);
    return Axis(means, covariances, inverse * covariances);
}

// What the planes explain of the product of moments i and j.
fn explained(x: Axis, y: Axis, i: u32, j: u32) -> f32 {
    return x.means[i] * x.means[j] + dot(x.covariances[i], x.slopes[j])
        + y.means[i] * y.means[j] + dot(y.covariances[i], y.slopes[j]);
}

// a1, a2 and t of an axis.
fn pose(a: Axis, g: vec2f, p: vec2f) -> vec3f {
    let s = a.slopes[0] + g.x * a.slopes[1] + g.y * a.slopes[2];
    return vec3f(s, a.means.x + g.x * a.means.y + g.y * a.means.z - dot(s, p));
}

// Depth, in units, at which a ray meets the plane that explains the registration in a window, of which `m` has the means.
fn plane_depth(ray: vec2f) -> f32 {
    let p = vec2f(m[2], m[3]);
    let suu = m[4] - p.x * p.x + covariance_damping;
    let suv = m[5] - p.x * p.y;
    let svv = m[6] - p.y * p.y + covariance_damping;
    let determinant = suu * svv - suv * suv;
    let inverse = mat2x2f(svv / determinant, -suv / determinant, -suv / determinant, suu / determinant);
    let x = axis(7u, p, inverse); let y = axis(13u, p, inverse);

    let kuu = m[21] - explained(x, y, 1u, 1u) + slope_damping;
    let kuv = m[22] - explained(x, y, 1u, 2u);
    let kvv = m[23] - explained(x, y, 2u, 2u) + slope_damping;
    let ru = explained(x, y, 1u, 0u) - m[19];
    let rv = explained(x, y, 2u, 0u) - m[20];
    let k = kuu * kvv - kuv * kuv;
    let g = vec2f((kvv * ru - kuv * rv) / k, (kuu * rv - kuv * ru) / k);

    let ax = pose(x, g, p); let ay = pose(y, g, p);
    let r1 = vec3f(ax.x, ay.x, g.x); let r2 = vec3f(ax.y, ay.y, g.y);
    let lengths = dot(r1, r1) * dot(r2, r2) + 1e-12;
    let normal = cross(r1, r2);
    let offset = dot(normal, vec3f(ax.z, ay.z, 1.0));
    let facing = dot(normal, vec3f(ray, 1.0));
    return offset * facing / (facing * facing + 1e-9) / sqrt(sqrt(lengths));
}

// The depth of the window whose means are in `m`, as far as the window is seen.
fn trusted(ray: vec2f, d: f32) -> f32 {
    let trust = m[0] / (m[0] + half_support);
    let support = m[0] + 1e-6;
    for (var k = 1u; k < moment_count; k++) { m[k] /= support; }
    return d + (normalised(max(plane_depth(ray) * unit_mm, 1.0)) - d) * trust;
}";

/// Measured depths of cells, and the cues of the depth refinement.
pub(super) const MEASURE: &str = "
let row = index / size.columns; let column = index % size.columns;
let ray = vec2f((f32(column) + 0.5) * cell - cx, (f32(row) + 0.5) * cell - cy) / focal;
let d = found[index].z;
let first = (column / 4u * moment_count * size.rows + row) * 4u + column % 4u;
for (var k = 0u; k < moment_count; k++) { m[k] = narrow[first + k * size.rows * 4u]; }
let near = trusted(ray, d);
for (var k = 0u; k < moment_count; k++) { m[k] = wide[first + k * size.rows * 4u]; }
let far = trusted(ray, d);
let depths = vec4f(isometric(row, column), near, far);
measured[index] = depths;
write_cues(index, found[index], depths);";

/// The same of rest positions: no plane is measured, and what was found stands in its place.
pub(super) const MEASURE_WITHOUT_PLANES: &str = "
let d = found[index].z;
let depths = vec4f(isometric(index / size.columns, index % size.columns), d, d);
measured[index] = depths;
write_cues(index, found[index], depths);";

pub(super) const CUE_FUNCTIONS: &str = "
// How far measured depths lie from the depth found, scaled and bounded, beside the coordinates.
fn write_cues(index: u32, position: vec4f, depths: vec4f) {
    let departures = clamp((depths - position.z) * departure_gain, vec4f(-largest_departure), vec4f(largest_departure));
    cues[index] = vec4f(position.xyz, departures.x);
    cues[size.count + index] = vec4f(departures.yzw, position.w);
}";

/// The refined depth, and the cues of the registration refinement.
pub(super) const REFINE_DEPTH: &str = "
let said = correction[index];
let depths = measured[index];
let weights = exp(said.yzw - max(said.y, max(said.z, said.w)));
let d = dot(weights, vec3f(found[index].z, depths.zw)) / (weights.x + weights.y + weights.z) + said.x;
let position = vec4f(found[index].xy, d, found[index].w);
out[index] = position;
write_cues(index, position, depths);";

/// The refined registration.
pub(super) const REFINE_REGISTRATION: &str = "
out[index] += vec4f(correction[index].xy, 0.0, correction[index].z);";
