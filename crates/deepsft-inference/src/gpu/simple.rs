//! Sums and pooling.

use super::shader::{Shader, View, addend, as_f32, stored};
use super::{Gpu, Kernel};
use crate::plan::{Added, Pool};

/// A map plus what is added.
pub(super) fn sum(gpu: &Gpu, map: View<'_>, added: (View<'_>, Added), output: View<'_>) -> Kernel {
    let mut shader = Shader::default();
    shader.bind_map("map", "read", map);
    shader.bind_map("out", "read_write", output);
    shader.addend(Some(added));
    shader.size("area", map.area());
    shader.size("width", map.shape.width);
    let addend = addend(Some(added), "(at / size.width)", "(at % size.width)");
    let value = stored(output.half, &(as_f32(map.half, "map[index]") + &addend));
    let body = format!("let q = index / size.area; let at = index % size.area;\nout[index] = {value};");
    shader.kernel(gpu, "", &body, map.area() * map.quads(), 1)
}

/// The largest values of windows of 3 x 3 places.
pub(super) fn pool(gpu: &Gpu, pool: &Pool, map: View<'_>, output: View<'_>) -> Kernel {
    let mut shader = Shader::default();
    shader.bind_map("map", "read", map);
    shader.bind_map("out", "read_write", output);
    for (name, value) in [
        ("height", map.shape.height),
        ("width", map.shape.width),
        ("area", output.area()),
        ("across", output.shape.width),
        ("stride", pool.stride),
        ("border", pool.border),
    ] {
        shader.size(name, value);
    }
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
    shader.kernel(gpu, "", &body, output.area() * output.quads(), 1)
}
