//! Sums and pooling.

use super::device::Gpu;
use super::shader::{GpuMap, Kernel, Shader, as_f32, skip_term, stored};
use crate::plan::{MaxPool, SkipInput};

/// A map plus its skip input.
pub(super) fn sum(gpu: &Gpu, map: GpuMap<'_>, skip: (GpuMap<'_>, SkipInput), output: GpuMap<'_>) -> Kernel {
    let mut shader = Shader::default();
    shader.bind_map("map", "read", map);
    shader.bind_map("out", "read_write", output);
    shader.skip(Some(skip));
    shader.sizes([("area", map.shape.area()), ("width", map.shape.width)]);
    let skip = skip_term(Some(skip), "(at / size.width)", "(at % size.width)");
    let value = stored(output.half, &(as_f32(map.half, "map[index]") + &skip));
    let body = format!("let q = index / size.area; let at = index % size.area;\nout[index] = {value};");
    shader.kernel(gpu, "", &body, map.shape.area() * map.quads(), 1)
}

/// The largest values of windows of 3 x 3 positions.
pub(super) fn pool(gpu: &Gpu, pool: &MaxPool, map: GpuMap<'_>, output: GpuMap<'_>) -> Kernel {
    let mut shader = Shader::default();
    shader.bind_map("map", "read", map);
    shader.bind_map("out", "read_write", output);
    shader.sizes([
        ("height", map.shape.height),
        ("width", map.shape.width),
        ("area", output.shape.area()),
        ("across", output.shape.width),
        ("stride", pool.stride),
        ("border", pool.border),
    ]);
    // Rows and columns before the first are beyond the last.
    let value = as_f32(map.half, "map[(q * size.height + row) * size.width + column]");
    let body = format!(
        "let q = index / size.area; let at = index % size.area;
let top = at / size.across * size.stride - size.border; let left = at % size.across * size.stride - size.border;
var most = vec4f(-3.4e38);
for (var k = 0u; k < 9u; k++) {{
let row = top + k / 3u; let column = left + k % 3u;
if row < size.height && column < size.width {{ most = max(most, {value}); }}
}}
out[index] = {};",
        stored(output.half, "most")
    );
    shader.kernel(gpu, "", &body, output.shape.area() * output.quads(), 1)
}
