//! The way of Winograd's convolutions to the points and back, see the module `winograd` of the processor's kernels.

use super::device::Gpu;
use super::shader::{
    GpuMap, Kernel, Shader, ShaderInput, ShaderSkip, as_f32, position_read, rectified, skip_term, stored,
};
use crate::cpu::{READ, TILE};
use crate::plan::{Convolution, MapShape};
use std::fmt::Write;

/// Sizes that both transforms read: of the map, and the numbers of tiles, of tiles beside one another and of quads.
fn tile_sizes([height, width]: [usize; 2], [tiles, across, all]: [usize; 3]) -> [(&'static str, usize); 5] {
    [
        ("height", height),
        ("width", width),
        ("tiles", tiles),
        ("across", across),
        ("all", all),
    ]
}

/// The quad `q` and the tile of an invocation, and its first row and column.
fn tile_of_index() -> String {
    format!(
        "let q = index / size.tiles; let tile = index % size.tiles; let step = size.tiles * size.all;
let top = tile / size.across * {TILE}u; let left = tile % size.across * {TILE}u;
"
    )
}

/// Takes what tiles read to the points: B^T d B.
pub(super) fn input_transform(gpu: &Gpu, sources: &[ShaderInput<'_>], read: GpuMap<'_>, columns: usize) -> Kernel {
    let (tiles, all) = (read.shape.area(), read.quads());
    let [height, width] = sources[0].1.size(sources[0].0.shape);
    let mut shader = Shader::default();
    let mut input = "fn input(quad: u32, row: u32, column: u32) -> vec4f {
let r = row - 1u; let c = column - 1u;
if r >= size.height || c >= size.width { return vec4f(); }
var q = quad;
"
    .to_owned();
    for (k, source) in sources.iter().enumerate() {
        shader.source(k, source);
        let value = format!("in{k}[q * size.area{k} + {}]", position_read(k, &source.1, "r", "c"));
        let value = rectified(source.1.rectified, &as_f32(source.0.half, &value));
        let _ = if k + 1 == sources.len() {
            writeln!(input, "return {value};\n}}")
        } else {
            writeln!(input, "if q < size.quads{k} {{ return {value}; }}\nq -= size.quads{k};")
        };
    }
    shader.bind("out", "read_write", read.buffer);
    shader.sizes(tile_sizes([height, width], [tiles, columns, all]));
    let mut s = tile_of_index();
    for i in 0..READ {
        for j in 0..READ {
            let _ = writeln!(s, "let d{i}{j} = input(q, top + {i}u, left + {j}u);");
        }
        s += &line_to_points(|j| format!("d{i}{j}"), |j| format!("let t{i}{j}"));
    }
    for j in 0..READ {
        let at = |i: usize| format!("out[{}u * step + index]", i * READ + j);
        s += &line_to_points(|i| format!("t{i}{j}"), at);
    }
    shader.kernel(gpu, &input, &s, tiles * all, 1)
}

/// B^T: a row or column of what a tile reads, at the points.
fn line_to_points(d: impl Fn(usize) -> String, to: impl Fn(usize) -> String) -> String {
    let [d0, d1, d2, d3, d4, d5] = [0, 1, 2, 3, 4, 5].map(d);
    let values = [
        format!("4.0 * {d0} - 5.0 * {d2} + {d4}"),
        format!("({d4} - 4.0 * {d2}) + ({d3} - 4.0 * {d1})"),
        format!("({d4} - 4.0 * {d2}) - ({d3} - 4.0 * {d1})"),
        format!("({d4} - {d2}) + 2.0 * ({d3} - {d1})"),
        format!("({d4} - {d2}) - 2.0 * ({d3} - {d1})"),
        format!("4.0 * {d1} - 5.0 * {d3} + {d5}"),
    ];
    assigned(&values, to)
}

/// A^T: sums at the points of a row or column, at the tile's positions.
fn line_to_positions(m: impl Fn(usize) -> String, to: impl Fn(usize) -> String) -> String {
    let [m0, m1, m2, m3, m4, m5] = [0, 1, 2, 3, 4, 5].map(m);
    let values = [
        format!("{m0} + ({m1} + {m2}) + ({m3} + {m4})"),
        format!("({m1} - {m2}) + 2.0 * ({m3} - {m4})"),
        format!("({m1} + {m2}) + 4.0 * ({m3} + {m4})"),
        format!("({m1} - {m2}) + 8.0 * ({m3} - {m4}) + {m5}"),
    ];
    assigned(&values, to)
}

fn assigned(values: &[String], to: impl Fn(usize) -> String) -> String {
    let lines = values.iter().enumerate();
    lines.map(|(k, value)| format!("{} = {value};\n", to(k))).collect()
}

/// Takes the sums at the points back to the tiles' positions: A^T m A; adds biases and the skip input.
pub(super) fn output_transform(
    gpu: &Gpu,
    convolution: &Convolution,
    sums: GpuMap<'_>,
    skip: ShaderSkip<'_>,
    output: GpuMap<'_>,
    columns: usize,
) -> Kernel {
    let (tiles, all) = (sums.shape.area(), sums.quads());
    let mut padded = convolution.filters.biases.clone();
    padded.resize(4 * all, 0.0);
    let biases = gpu.numbers(&padded, false);
    let mut shader = Shader::default();
    shader.bind("sums", "read", sums.buffer);
    shader.bind("biases", "read", &biases);
    shader.bind_map("out", "read_write", output);
    shader.skip(skip);
    let MapShape { height, width, .. } = output.shape;
    shader.sizes(tile_sizes([height, width], [tiles, columns, all]));
    let value = format!("value{}", skip_term(skip, "row", "column"));
    let value = rectified(convolution.rectified, &value);
    let value = stored(output.half, &value);
    let put = format!(
        "fn put(q: u32, row: u32, column: u32, value: vec4f) {{
if row < size.height && column < size.width {{
out[(q * size.height + row) * size.width + column] = {value};
}}
}}"
    );
    let mut s = tile_of_index() + "let bias = biases[q];\n";
    for j in 0..READ {
        for i in 0..READ {
            let _ = writeln!(s, "let m{i}{j} = sums[{}u * step + index];", i * READ + j);
        }
        s += &line_to_positions(|i| format!("m{i}{j}"), |i| format!("let t{i}{j}"));
    }
    for i in 0..TILE {
        s += &line_to_positions(|j| format!("t{i}{j}"), |j| format!("let o{i}{j}"));
        for j in 0..TILE {
            let _ = writeln!(s, "put(q, top + {i}u, left + {j}u, o{i}{j} + bias);");
        }
    }
    shader.kernel(gpu, &put, &s, tiles * all, 1)
}
