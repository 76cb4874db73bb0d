//! Convolutions as shaders.
//!
//! A map lies in quads of channels: [quad][row][column], four channels side by side. Neighbouring invocations make neighbouring positions:
//! they read maps side by side and the same filters. Each makes several positions of several quads, so that it multiplies often what it
//! read once.

use super::device::Gpu;
use super::shader::{
    GpuMap, Kernel, Shader, ShaderInput, ShaderSkip, as_f32, is_whole, padded, position_read, rectified, skip_term,
    stored,
};
use super::winograd::{input_transform, output_transform};
use crate::cpu::{POINTS, TILE, filter_at_point};
use crate::plan::{Convolution, Filters, MapShape};
use std::fmt::Write;
use wgpu::Buffer;

/// Positions and quads that an invocation makes. Twice as many quads save a processor that plays the GPU a third of its time, but it then
/// compiles for three times as long, and a GPU needs many invocations.
const STRETCH: usize = 4;
const BLOCK: usize = 2;

/// Numbers of what the tiles of a Winograd convolution read at the points, and of their sums.
pub(super) fn scratch(convolution: &Convolution, shapes: &[MapShape], output: MapShape) -> [usize; 2] {
    if !is_winograd(convolution) {
        return [0, 0];
    }
    let tiles = output.height.div_ceil(TILE) * output.width.div_ceil(TILE);
    let (_, read) = convolution.input_channels(shapes, padded);
    [read, padded(output.channels)].map(|channels| POINTS * tiles * channels)
}

fn is_winograd(convolution: &Convolution) -> bool {
    convolution.filters.kernel == 3 && convolution.stride == 1
}

/// The kernels of a convolution, with buffers for what [`scratch`] counts.
pub(super) fn kernels(
    gpu: &Gpu,
    (convolution, shapes): (&Convolution, &[MapShape]),
    sources: &[ShaderInput<'_>],
    skip: ShaderSkip<'_>,
    output: GpuMap<'_>,
    [read, sums]: &[Buffer; 2],
) -> Vec<Kernel> {
    let (channels, count) = convolution.input_channels(shapes, padded);
    if !is_winograd(convolution) {
        let product = Product {
            sources,
            skip,
            output,
            kernel: convolution.filters.kernel,
            stride: convolution.stride,
            rectified: convolution.rectified,
            batches: 1,
        };
        return vec![product.kernel(gpu, &convolution.filters, &channels)];
    }
    let [rows, columns] = [output.shape.height, output.shape.width].map(|side| side.div_ceil(TILE));
    // Tiles at a point: positions of a map with one row.
    let at_points = |channels: usize, buffer| GpuMap {
        shape: MapShape::new(channels, 1, rows * columns),
        half: false,
        buffer,
    };
    let read = at_points(count, read);
    let sums = at_points(padded(output.shape.channels), sums);
    let product = Product {
        sources: &[(read, convolution.inputs[0].map.plain())],
        skip: None,
        output: sums,
        kernel: 1,
        stride: 1,
        rectified: false,
        batches: POINTS,
    };
    vec![
        input_transform(gpu, sources, read, columns),
        product.kernel(gpu, &convolution.filters, &channels),
        output_transform(gpu, convolution, sums, skip, output, columns),
    ]
}

/// Products of filters and what is read, summed over taps and channels.
struct Product<'a> {
    sources: &'a [ShaderInput<'a>],
    skip: ShaderSkip<'a>,
    output: GpuMap<'a>,
    kernel: usize,
    stride: usize,
    rectified: bool,
    /// Products of their own, each with its filters, one after another in all buffers. Then nothing is added, biases neither.
    batches: usize,
}

impl Product<'_> {
    /// With these filters, which read the channels `padded` of the sources.
    fn kernel(&self, gpu: &Gpu, filters: &Filters, padded: &[usize]) -> Kernel {
        let (places, quads_out) = (self.output.shape.area(), self.output.quads());
        let (tile, across) = (places.min(STRETCH), quads_out.min(BLOCK));
        let (stretches, blocks) = (places.div_ceil(tile), quads_out.div_ceil(across));
        let quads_in: usize = self.sources.iter().map(|(view, _)| view.quads()).sum();
        let packed = self.packed(filters, padded, 4 * quads_in, across);
        let half = gpu.has_f16();
        let filters = gpu.numbers(&packed, half);
        let (view, input) = &self.sources[0];
        let [rows, columns] = input.size(view.shape);

        let mut shader = Shader::default();
        for (k, source) in self.sources.iter().enumerate() {
            shader.source(k, source);
        }
        shader.bind_numbers("filters", "read", half, &filters);
        shader.bind_map("out", "read_write", self.output);
        shader.skip(self.skip);
        shader.sizes([
            ("blocks", blocks),
            ("stretches", stretches),
            ("places", places),
            ("width", self.output.shape.width),
            ("quads", quads_out),
            ("rows", rows),
            ("columns", columns),
            ("block", self.kernel * self.kernel * quads_in * 4 * across),
            ("biases", packed.len() / 4 - quads_out),
        ]);
        let body = self.body(tile, across, half);
        shader.kernel(gpu, "", &body, blocks * stretches, self.batches)
    }

    /// Filters as the shader reads them: [batch][block][tap][input][quad of the block][4]. Then the biases, unless there are batches.
    fn packed(&self, filters: &Filters, padded: &[usize], inputs: usize, across: usize) -> Vec<f32> {
        let winograd = self.batches > 1;
        let (block, blocks) = (4 * across, self.output.quads().div_ceil(across));
        let (taps, fan_in) = (self.kernel * self.kernel, filters.kernel * filters.kernel);
        let mut packed = vec![0.0; self.batches * blocks * taps * inputs * block];
        for (index, filter) in filters.weights.chunks_exact(fan_in).enumerate() {
            let (output, input) = (index / filters.inputs, padded[index % filters.inputs]);
            let mut set = |batch: usize, tap: usize, value: f32| {
                let line = ((batch * blocks + output / block) * taps + tap) * inputs + input;
                packed[line * block + output % block] = value;
            };
            if winograd {
                let at = |i: usize, j: usize| f64::from(filter[3 * i + j]);
                let filter = std::array::from_fn(|i| std::array::from_fn(|j| at(i, j)));
                (0..POINTS).for_each(|point| set(point, 0, filter_at_point(TILE, filter, point)));
            } else {
                (0..).zip(filter).for_each(|(tap, &value)| set(0, tap, value));
            }
        }
        if !winograd {
            packed.extend(&filters.biases);
            packed.resize(packed.len().next_multiple_of(4), 0.0);
        }
        packed
    }

    /// Invocation `index` makes `tile` positions of the quads of one block.
    fn body(&self, tile: usize, across: usize, half: bool) -> String {
        let is_plain = self.kernel == 1 && self.stride == 1 && self.sources.iter().all(|(_, input)| is_whole(input));
        let mut s = "let block = index / size.stretches; let first = index % size.stretches;
let stretches = size.stretches; let places = size.places;
var f = (batch * size.blocks + block) * size.block;
"
        .to_owned();
        for p in 0..tile {
            let _ = writeln!(s, "let p{p} = min(first + {p}u * stretches, places - 1u);");
            for q in 0..across {
                let _ = writeln!(s, "var a{p}_{q} = vec4f();");
            }
        }
        if !is_plain {
            let (side, border, stride) = (self.kernel, self.kernel / 2, self.stride);
            let _ = writeln!(
                s,
                "let rows = i32(size.rows); let columns = i32(size.columns);
for (var i = 0; i < {side}; i++) {{ for (var j = 0; j < {side}; j++) {{"
            );
            for p in 0..tile {
                let _ = writeln!(
                    s,
                    "let r{p} = i32(p{p} / size.width) * {stride} + i - {border};
let c{p} = i32(p{p} % size.width) * {stride} + j - {border};
let is{p} = r{p} >= 0 && r{p} < rows && c{p} >= 0 && c{p} < columns;"
                );
            }
        }
        for (k, (view, input)) in self.sources.iter().enumerate() {
            for p in (0..tile).filter(|_| !is_plain) {
                let place = position_read(k, input, &format!("u32(r{p})"), &format!("u32(c{p})"));
                let _ = writeln!(s, "let at{k}_{p} = select(0u, {place}, is{p});");
            }
            let _ = writeln!(
                s,
                "let area{k} = size.area{k}; let end{k} = (batch + 1u) * size.quads{k} * area{k};
for (var c = batch * size.quads{k} * area{k}; c < end{k}; c += area{k}) {{"
            );
            for line in 0..4 {
                for q in 0..across {
                    let filter = as_f32(half, &format!("filters[f + {}u]", line * across + q));
                    let _ = writeln!(s, "let w{line}_{q} = {filter};");
                }
            }
            let _ = writeln!(s, "f += {}u;", 4 * across);
            for p in 0..tile {
                let value = if is_plain {
                    as_f32(view.half, &format!("in{k}[c + p{p}]"))
                } else {
                    let value = as_f32(view.half, &format!("in{k}[c + at{k}_{p}]"));
                    format!("select(vec4f(), {value}, is{p})")
                };
                let _ = writeln!(s, "let x{p} = {};", rectified(input.rectified, &value));
                for q in 0..across {
                    let _ = writeln!(
                        s,
                        "a{p}_{q} += w0_{q} * x{p}.x + w1_{q} * x{p}.y + w2_{q} * x{p}.z + w3_{q} * x{p}.w;"
                    );
                }
            }
            s += "}\n";
        }
        if !is_plain {
            s += "}}\n";
        }
        let bias = if self.batches == 1 {
            format!(" + {}", as_f32(half, "filters[size.biases + q]"))
        } else {
            String::new()
        };
        for q in 0..across {
            let _ = writeln!(s, "{{ let q = block * {across}u + {q}u; if q < size.quads {{");
            for p in 0..tile {
                let [row, column] = ["/", "%"].map(|by| format!("(p{p} {by} size.width)"));
                let skip = skip_term(self.skip, &row, &column);
                let value = rectified(self.rectified, &format!("a{p}_{q}{bias}{skip}"));
                let value = stored(self.output.half, &value);
                let _ = writeln!(
                    s,
                    "if first + {p}u * stretches < places {{ out[(batch * size.quads + q) * places + p{p}] = {value}; }}"
                );
            }
            s += "} }\n";
        }
        s
    }
}
