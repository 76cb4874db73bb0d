//! Shaders and what they are bound to.

use super::device::Gpu;
use crate::plan::{LayerInput, MapShape, SkipInput};
use wgpu::Buffer;

/// Invocations of a group.
const GROUP: usize = 64;

pub(crate) fn quads(channels: usize) -> usize {
    channels.div_ceil(4)
}

/// Number of channels of the quads of `channels` channels.
pub(crate) fn padded(channels: usize) -> usize {
    4 * quads(channels)
}

/// A map in its buffer.
#[derive(Clone, Copy)]
pub(crate) struct GpuMap<'a> {
    pub(crate) shape: MapShape,
    /// Whether its numbers have 16 bits.
    pub(crate) half: bool,
    pub(crate) buffer: &'a Buffer,
}

impl GpuMap<'_> {
    pub(crate) fn quads(&self) -> usize {
        quads(self.shape.channels)
    }
}

/// A map that is read, and how.
pub(crate) type ShaderInput<'a> = (GpuMap<'a>, LayerInput);

pub(crate) type ShaderSkip<'a> = Option<(GpuMap<'a>, SkipInput)>;

/// Whether a map is read position by position.
pub(crate) fn is_whole(input: &LayerInput) -> bool {
    input.factor == 1 && input.cropped == [0, 0]
}

/// A shader that is being written. Sizes are not part of its text: layers that differ in nothing else share a pipeline, and
/// compiling takes longest.
#[derive(Default)]
pub(crate) struct Shader<'a> {
    declarations: String,
    buffers: Vec<&'a Buffer>,
    sizes: Vec<(String, u32)>,
    has_f16: bool,
}

impl<'a> Shader<'a> {
    /// A buffer of quads by the name `name`, which is not `read`; `access` is `read` or `read_write`.
    pub(crate) fn bind(&mut self, name: &str, access: &str, buffer: &'a Buffer) {
        self.bind_as(name, access, "vec4f", buffer);
    }

    /// The same of numbers of 32 or 16 bits.
    pub(crate) fn bind_numbers(&mut self, name: &str, access: &str, half: bool, buffer: &'a Buffer) {
        self.has_f16 |= half;
        self.bind_as(name, access, if half { "vec4<f16>" } else { "vec4f" }, buffer);
    }

    pub(crate) fn bind_map(&mut self, name: &str, access: &str, map: GpuMap<'a>) {
        self.bind_numbers(name, access, map.half, map.buffer);
    }

    /// A buffer of another type.
    pub(crate) fn bind_as(&mut self, name: &str, access: &str, element: &str, buffer: &'a Buffer) {
        let binding = self.buffers.len();
        self.declarations +=
            &format!("@group(0) @binding({binding}) var<storage, {access}> {name}: array<{element}>;\n");
        self.buffers.push(buffer);
    }

    /// A number that the shader finds in `size.name`.
    pub(crate) fn size(&mut self, name: impl Into<String>, value: usize) {
        self.sizes.push((name.into(), value as u32));
    }

    pub(crate) fn sizes<const N: usize>(&mut self, sizes: [(&str, usize); N]) {
        sizes.into_iter().for_each(|(name, value)| self.size(name, value));
    }

    /// The map that is the source `k`.
    pub(crate) fn source(&mut self, k: usize, (view, input): &ShaderInput<'a>) {
        self.bind_map(&format!("in{k}"), "read", *view);
        for (name, value) in [
            ("quads", view.quads()),
            ("area", view.shape.area()),
            ("width", view.shape.width),
            ("factor", input.factor),
            ("top", input.cropped[0]),
        ] {
            self.size(format!("{name}{k}"), value);
        }
    }

    /// What [`skip_term`] reads.
    pub(crate) fn skip(&mut self, skip: ShaderSkip<'a>) {
        let Some((view, SkipInput { factor, top, .. })) = skip else {
            return;
        };
        self.bind_map("added", "read", view);
        self.sizes([
            ("added_area", view.shape.area()),
            ("added_width", view.shape.width),
            ("added_factor", factor),
            ("added_top", top),
        ]);
    }

    /// The shader's kernel: `body` is run for each `index` below `count` and each `batch` below `batches`.
    pub(crate) fn kernel(mut self, gpu: &Gpu, functions: &str, body: &str, count: usize, batches: usize) -> Kernel {
        self.size("count", count);
        let fields: String = self.sizes.iter().map(|(name, _)| format!("{name}: u32, ")).collect();
        let enable = if self.has_f16 { "enable f16;\n" } else { "" };
        let source = format!(
            "{enable}struct Sizes {{ {fields} }}
{}@group(0) @binding({}) var<uniform> size: Sizes;
{functions}
@compute @workgroup_size({GROUP})
fn main(@builtin(global_invocation_id) id: vec3u) {{
let index = id.x; let batch = id.y;
if index >= size.count {{ return; }}
{body}
}}
",
            self.declarations,
            self.buffers.len()
        );
        let values: Vec<u8> = self.sizes.iter().flat_map(|(_, value)| value.to_le_bytes()).collect();
        let sizes = gpu.constants(&values, wgpu::BufferUsages::UNIFORM);
        let pipeline = gpu.pipeline(&source);
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(self.buffers.into_iter().chain([&sizes]))
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Kernel {
            pipeline,
            bindings,
            groups: [count.div_ceil(GROUP), batches].map(|count| count as u32),
        }
    }
}

/// A compiled shader with its buffers; clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    groups: [u32; 2],
}

impl Kernel {
    pub(crate) fn run(&self, pass: &mut wgpu::ComputePass<'_>) {
        let [x, y] = self.groups;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(x, y, 1);
    }
}

/// Negative values are zero where it is so.
pub(crate) fn rectified(is_rectified: bool, value: &str) -> String {
    if is_rectified {
        format!("max({value}, vec4f())")
    } else {
        value.to_owned()
    }
}

/// Where in a quad of source `k` what is read at a row and column lies.
pub(crate) fn position_read(k: usize, input: &LayerInput, row: &str, column: &str) -> String {
    if is_whole(input) {
        return format!("{row} * size.width{k} + {column}");
    }
    format!("({row} + size.top{k}) / size.factor{k} * size.width{k} + {column} / size.factor{k}")
}

/// The term that adds the skip input of quad `q` at a position.
pub(crate) fn skip_term(skip: ShaderSkip<'_>, row: &str, column: &str) -> String {
    let Some((view, how)) = skip else {
        return String::new();
    };
    let position = match how {
        SkipInput { factor: 1, top: 0, .. } => format!("{row} * size.added_width + {column}"),
        _ => {
            format!("({row} + size.added_top) / size.added_factor * size.added_width + {column} / size.added_factor")
        }
    };
    format!(
        " + {}",
        as_f32(view.half, &format!("added[q * size.added_area + {position}]"))
    )
}

/// What a map or filters hold, to calculate with.
pub(crate) fn as_f32(half: bool, value: &str) -> String {
    if half {
        format!("vec4f({value})")
    } else {
        value.to_owned()
    }
}

/// What a map holds of a result.
pub(crate) fn stored(half: bool, value: &str) -> String {
    if half {
        format!("vec4<f16>({value})")
    } else {
        value.to_owned()
    }
}
