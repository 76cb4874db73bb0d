//! glTF 2.0, binary (`.glb`) or as JSON (`.gltf`): the triangles of the default scene with their base colour textures.

use super::accessors::{Buffers, content, named};
use super::baking::from_linear;
use super::{ScanPart, Textures, Wrap, refused};
use crate::error::FormatError;
use crate::reasons::json_reason;
use deepsft_geometry::glam::{DAffine2, DMat4, DQuat, DVec2, DVec3, Mat4, Quat, Vec2, Vec3};
use gltf::binary::Glb;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Image, Index, Root, Scene, Texture};
use serde_json::Value;
use std::collections::HashSet;

/// glTF counts in metres.
pub(super) const MM_PER_UNIT: f64 = 1000.0;

/// Beginnings of extensions that a file may need and that are read, or say nothing of shape and base colour.
const MEANINGLESS: [&str; 7] = [
    "EXT_texture_webp",
    "EXT_texture_avif",
    "KHR_materials_",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
    "KHR_lights_",
    "EXT_lights_",
];

/// Nodes below one another at most.
const DEEPEST_NODE: usize = 64;

/// Bytes before the first chunk of a `.glb`.
const GLB_HEADER: usize = 12;

/// The parts of a file, and if they are wanted the textures it names.
///
/// The document is not validated by the crate `gltf`: it would refuse files without the bounds of their positions, which
/// nobody needs here, and indexes with what it has not checked. Every index is looked up when it is followed.
pub(super) fn parts(bytes: &[u8], textures: &mut Textures<'_>) -> Result<Vec<ScanPart>, FormatError> {
    let (json, binary) = if bytes.starts_with(b"glTF") {
        let word = bytes.get(8..GLB_HEADER).and_then(|word| word.try_into().ok());
        let length = word.map(u32::from_le_bytes);
        // The crate takes the header's length for at least its own.
        if length.is_none_or(|length| (length as usize) < GLB_HEADER) {
            return refused("it is cut short: copy it again from where it came");
        }
        let glb = Glb::from_slice(bytes).or_else(|error| {
            refused(format!(
                "it is no whole binary glTF ({error}): copy it again from where it came"
            ))
        })?;
        (glb.json, glb.bin)
    } else {
        (bytes.into(), None)
    };
    let root = Root::from_slice(&json).or_else(|error| refused(json_reason(&error)))?;
    if !root.asset.version.starts_with("2.") {
        return refused(format!(
            "it is glTF of version {:?}, and 2.0 is read: export it anew",
            root.asset.version
        ));
    }
    let needed = |extension: &&String| !MEANINGLESS.iter().any(|start| extension.starts_with(start));
    if let Some(extension) = root.extensions_required.iter().find(needed) {
        return refused(format!(
            "it needs the extension {extension:?}, which is not read: export it without compression"
        ));
    }
    let buffers = Buffers::new(&root, binary.as_deref(), textures)?;
    let Some(scene) = root.get(root.scene.unwrap_or(Index::<Scene>::new(0))) else {
        return refused("it has no scene: export it with its scene");
    };
    let mut reading = Reading {
        json: &json,
        root: &root,
        buffers,
        textures,
        parts: Vec::new(),
        nodes: HashSet::new(),
    };
    for &node in &scene.nodes {
        reading.node(node, DMat4::IDENTITY, 0)?;
    }
    Ok(reading.parts)
}

/// What has been read so far.
struct Reading<'a, 't> {
    json: &'a [u8],
    root: &'a Root,
    buffers: Buffers<'a>,
    textures: &'a mut Textures<'t>,
    parts: Vec<ScanPart>,
    /// Nodes that have been read: each has one place in the tree.
    nodes: HashSet<usize>,
}

impl Reading<'_, '_> {
    fn node(&mut self, index: Index<Node>, scene_from_parent: DMat4, depth: usize) -> Result<(), FormatError> {
        if depth > DEEPEST_NODE || !self.nodes.insert(index.value()) {
            return refused(format!(
                "its nodes are no tree: node {index} has two places or lies too deep"
            ));
        }
        let root = self.root;
        let node = named(root, index, "node")?;
        let scene_from_node = scene_from_parent * parent_from_node(node);
        if let Some(mesh) = node.mesh {
            let mesh = named(root, mesh, "mesh")?;
            let name = mesh.name.as_deref().unwrap_or("mesh");
            for primitive in &mesh.primitives {
                let named = |reason| format!("its part {name:?}: {reason}");
                if primitive.mode != Checked::Valid(Mode::Triangles) {
                    let note = named("it is not made of triangles, and was left out".to_owned());
                    self.textures.note(note);
                    continue;
                }
                let part = self.part(name, primitive, scene_from_node);
                (self.parts).extend(part.or_else(|error| refused(named(error.to_string())))?);
            }
        }
        for &child in node.children.iter().flatten() {
            self.node(child, scene_from_node, depth + 1)?;
        }
        Ok(())
    }

    /// A part; `None` when it has no texture coordinates and no colours either.
    fn part(
        &mut self,
        name: &str,
        primitive: &Primitive,
        scene_from_node: DMat4,
    ) -> Result<Option<ScanPart>, FormatError> {
        let material = primitive.material.map(|index| named(self.root, index, "material"));
        let material = material.transpose()?;
        // Older files have their colours in specular-glossiness materials.
        let older = material.and_then(|material| material.extensions.as_ref()?.pbr_specular_glossiness.as_ref());
        let newer = material.map(|material| &material.pbr_metallic_roughness);
        let newer_texture = newer.and_then(|newer| newer.base_color_texture.as_ref());
        let base = newer_texture.or_else(|| older?.diffuse_texture.as_ref());
        let factor = match (newer_texture, older) {
            (None, Some(older)) => Some(older.diffuse_factor.0),
            _ => newer.map(|newer| newer.base_color_factor.0),
        };
        let transform = base.and_then(|base| base.extensions.as_ref()?.texture_transform.as_ref());
        let attribute = |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = attribute(Semantic::Positions) else {
            return refused("it has no positions");
        };
        let set = base.map_or(0, |base| {
            let moved = transform.and_then(|transform| transform.tex_coord);
            moved.unwrap_or(base.tex_coord)
        });
        let in_scene = |p: [f64; 3]| scene_from_node.transform_point3(p.into());
        let positions: Vec<DVec3> = self.buffers.elements(positions)?.into_iter().map(in_scene).collect();
        let in_texture = transform.map_or(DAffine2::IDENTITY, |transform| {
            let [scale, offset] = [transform.scale.0, transform.offset.0].map(|pair| Vec2::from(pair).as_dvec2());
            // Counter-clockwise in an image whose v points down.
            DAffine2::from_scale_angle_translation(DVec2::ONE, -f64::from(transform.rotation.0), offset)
                * DAffine2::from_scale(scale)
        });
        let (mut texture, mut wraps) = (None, [Wrap::default(); 2]);
        let texture_coordinates: Vec<DVec2> = if let Some(uv) = attribute(Semantic::TexCoords(set)) {
            if let Some(base) = base {
                (texture, wraps) = (self.texture(base.index), self.wraps(base.index));
            }
            let uv = self.buffers.elements(uv)?.into_iter();
            uv.map(|uv| in_texture.transform_point2(uv.into())).collect()
        } else {
            let reason = format!("its part {name:?}: it has no texture coordinates (TEXCOORD_{set})");
            let has_color = (factor.is_some() || attribute(Semantic::Colors(0)).is_some()) && self.textures.are_wanted;
            if base.is_some() || !has_color {
                let what = if has_color { "took its colour" } else { "was left out" };
                self.textures.notes.push(format!("{reason}, and {what}"));
            }
            if !has_color {
                return Ok(None);
            }
            vec![DVec2::ZERO; positions.len()]
        };
        let colors = self.colors(factor, attribute(Semantic::Colors(0)), positions.len())?;
        let (places, vertices) = (texture_coordinates.len(), positions.len());
        if places != vertices {
            return refused(format!("{places} texture coordinates for {vertices} vertices"));
        }
        let corners: Vec<usize> = match primitive.indices {
            Some(indices) => {
                let indices = self.buffers.elements(indices)?.into_iter();
                indices.map(|[index]| index as usize).collect()
            }
            None => (0..vertices).collect(),
        };
        if let Some(index) = corners.iter().find(|&&index| index >= vertices) {
            return refused(format!(
                "a face names vertex {index}, there are {vertices}: export it again"
            ));
        }
        let mut faces = corners.as_chunks::<3>().0.to_vec();
        if scene_from_node.determinant() < 0.0 {
            // A mirrored node turns the faces over.
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        Ok(Some(ScanPart {
            name: name.to_owned(),
            faces,
            positions,
            texture_coordinates,
            texture,
            wraps,
            colors,
        }))
    }

    /// The sRGB colours of `count` vertices: linear ones of a material, of the vertices, or both multiplied. Empty without either.
    fn colors(
        &mut self,
        factor: Option<[f32; 4]>,
        of_vertices: Option<Index<Accessor>>,
        count: usize,
    ) -> Result<Vec<[u8; 3]>, FormatError> {
        let srgb = |light: [f64; 3]| light.map(|light| from_linear(light).round() as u8);
        let factor = factor.map(|[r, g, b, _]| [r, g, b].map(f64::from));
        let Some(accessor) = of_vertices else {
            return Ok(factor.map_or(Vec::new(), |factor| vec![srgb(factor); count]));
        };
        let opaque = |[r, g, b, _]: [f64; 4]| [r, g, b];
        let lights = match self.buffers.elements::<4>(accessor) {
            Ok(lights) => lights.into_iter().map(opaque).collect(),
            Err(_) => self.buffers.elements::<3>(accessor)?,
        };
        if lights.len() != count {
            return refused(format!("{} colours for {count} vertices", lights.len()));
        }
        let [r, g, b] = factor.unwrap_or([1.0; 3]);
        Ok(lights
            .into_iter()
            .map(|light| srgb([light[0] * r, light[1] * g, light[2] * b]))
            .collect())
    }

    /// How a texture goes on along u and v.
    fn wraps(&self, index: Index<Texture>) -> [Wrap; 2] {
        let sampler = self.root.get(index).and_then(|texture| texture.sampler);
        let Some(sampler) = sampler.and_then(|sampler| self.root.get(sampler)) else {
            return [Wrap::Repeat; 2];
        };
        [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            _ => Wrap::Repeat,
        })
    }

    /// The number of the picture of a texture, if textures are wanted and it can be had.
    fn texture(&mut self, index: Index<Texture>) -> Option<usize> {
        if !self.textures.are_wanted {
            return None;
        }
        let image_of = |source| Some((source, self.root.get(source)?));
        let source = self.root.get(index).map(|texture| texture.source);
        let Some((source, image)) = source
            .and_then(image_of)
            .or_else(|| image_of(self.other_source(index)?))
        else {
            let note = format!("its texture {index} is none of PNG, JPEG, WebP and AVIF");
            self.textures.note(note);
            return None;
        };
        let (buffers, textures) = (&self.buffers, &mut self.textures);
        match (&image.uri, image.buffer_view) {
            // Data within the URI is no name to tell people.
            (Some(uri), _) if uri.starts_with("data:") => {
                textures.number_or_note(&format!("image {source}"), |textures| content(uri, textures))
            }
            (Some(uri), _) => textures.number_or_note(uri, |textures| content(uri, textures)),
            (None, Some(view)) => {
                textures.number_or_note(&format!("buffer view {view}"), |_| Ok(buffers.view(view)?.0.to_vec()))
            }
            (None, None) => {
                textures.note(format!("its texture {index} is not there"));
                None
            }
        }
    }

    /// The image of a texture that has none but in a format of an extension, which the crate `gltf` leaves out.
    fn other_source(&self, index: Index<Texture>) -> Option<Index<Image>> {
        let document: Value = serde_json::from_slice(self.json).ok()?;
        let extensions = document.get("textures")?.get(index.value())?.get("extensions")?;
        let source = |name| extensions.get(name)?.get("source")?.as_u64();
        let source = source("EXT_texture_webp").or_else(|| source("EXT_texture_avif"))?;
        Some(Index::new(u32::try_from(source).ok()?))
    }
}

/// Where a node has itself in the frame of the one above.
fn parent_from_node(node: &Node) -> DMat4 {
    let vector = |numbers: [f32; 3]| Vec3::from_array(numbers).as_dvec3();
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix).as_dmat4(),
        None => DMat4::from_scale_rotation_translation(
            node.scale.map_or(DVec3::ONE, vector),
            (node.rotation).map_or(DQuat::IDENTITY, |turn| Quat::from_array(turn.0).as_dquat().normalize()),
            node.translation.map_or(DVec3::ZERO, vector),
        ),
    }
}
