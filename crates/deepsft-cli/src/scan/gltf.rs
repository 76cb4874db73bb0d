//! glTF 2.0, binary (`.glb`) or as JSON (`.gltf`): the triangles of the default scene with their base colour textures.
//!
//! Read without a crate: what a template needs of the format is small, and its usual reader would switch on a feature of
//! `serde_json` on which half of the workspace is built.

use super::{Part, Scan, texture_beside};
use anyhow::{Context, Result, anyhow, bail};
use base64::Engine;
use deepsft::decode_picture;
use deepsft_geometry::Picture;
use deepsft_geometry::glam::{DMat4, DQuat, DVec2, DVec3};
use serde_json::Value;
use std::collections::HashSet;
use std::fs;
use std::path::{Component, Path};

/// glTF counts in metres.
const MM_PER_UNIT: f64 = 1000.0;

/// Nodes below one another at most.
const DEEPEST_NODE: usize = 64;

/// Most vertices or indices of an accessor.
const MOST_ELEMENTS: usize = 20_000_000;

const TRIANGLES: u64 = 4;

/// Reads a file, and if asked the textures it names.
pub fn read(path: &Path, textures_wanted: bool) -> Result<Scan> {
    let document = Document::open(path)?;
    let mut reading = Reading {
        document: &document,
        textures_wanted,
        of_image: Vec::new(),
        textures: Vec::new(),
        parts: Vec::new(),
        nodes: HashSet::new(),
    };
    let scene = document.json.get("scene").and_then(Value::as_u64).unwrap_or(0) as usize;
    let roots = match document.item("scenes", scene) {
        Ok(scene) => indices(scene, "nodes"),
        Err(_) => bail!("it has no scene"),
    };
    for root in roots {
        reading.node(root, DMat4::IDENTITY, 0)?;
    }
    Ok(Scan {
        parts: reading.parts,
        textures: reading.textures,
        mm_per_unit: MM_PER_UNIT,
    })
}

/// The JSON of a file with its buffers.
struct Document<'a> {
    path: &'a Path,
    json: Value,
    buffers: Vec<Vec<u8>>,
}

impl<'a> Document<'a> {
    fn open(path: &'a Path) -> Result<Self> {
        let bytes = fs::read(path)?;
        let (json, binary) = if bytes.starts_with(b"glTF") {
            chunks(&bytes)?
        } else {
            (&bytes[..], None)
        };
        let json: Value = serde_json::from_slice(json).context("its JSON cannot be read")?;
        let version = json
            .pointer("/asset/version")
            .and_then(Value::as_str)
            .unwrap_or_default();
        if !version.starts_with("2.") {
            bail!("it is glTF of version {version:?}, expected 2.0");
        }
        if let Some(extension) = json.pointer("/extensionsRequired/0") {
            bail!("it needs the extension {extension}, which is not read: export it without compression");
        }
        let mut document = Self {
            path,
            json,
            buffers: Vec::new(),
        };
        let buffers = document
            .json
            .get("buffers")
            .and_then(Value::as_array)
            .cloned()
            .unwrap_or_default();
        for (number, buffer) in buffers.iter().enumerate() {
            let content = match (buffer.get("uri").and_then(Value::as_str), binary) {
                (Some(uri), _) => document.content(uri).with_context(|| format!("its buffer {number}"))?,
                (None, Some(binary)) if number == 0 => binary.to_vec(),
                _ => bail!("its buffer {number} is not there"),
            };
            document.buffers.push(content);
        }
        Ok(document)
    }

    /// The bytes that a URI stands for: data within it, or a file beside the document.
    fn content(&self, uri: &str) -> Result<Vec<u8>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, coded) = data
                .split_once(";base64,")
                .ok_or_else(|| anyhow!("a data URI is not base64"))?;
            return Ok(base64::engine::general_purpose::STANDARD.decode(coded)?);
        }
        let name = uri.replace("%20", " ");
        let within = Path::new(&name)
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !within {
            bail!("it names {name:?}, which is not in its folder");
        }
        let place = self.path.parent().unwrap_or(Path::new(".")).join(&name);
        let read = || -> Result<Vec<u8>> {
            if !fs::metadata(&place)?.is_file() {
                bail!("it is not a file");
            }
            Ok(fs::read(&place)?)
        };
        read().with_context(|| format!("the file {}", place.display()))
    }

    fn item(&self, list: &str, number: usize) -> Result<&Value> {
        let item = self.json.get(list).and_then(|list| list.get(number));
        item.ok_or_else(|| anyhow!("it names {list} {number}, which is not there"))
    }

    /// The bytes of a buffer view and the distance between its elements, if it says one.
    fn view(&self, number: usize) -> Result<(&[u8], Option<usize>)> {
        let view = self.item("bufferViews", number)?;
        let at = |field: &str| whole(view, field).unwrap_or(0);
        let buffer = (self.buffers.get(at("buffer"))).ok_or_else(|| anyhow!("buffer view {number} has no buffer"))?;
        let end = at("byteOffset").checked_add(at("byteLength"));
        let bytes = end.and_then(|end| buffer.get(at("byteOffset")..end));
        let bytes =
            bytes.ok_or_else(|| anyhow!("buffer view {number} reaches beyond its buffer: the file is cut short"))?;
        Ok((bytes, whole(view, "byteStride")))
    }

    /// The elements of an accessor, `components` numbers each.
    fn accessor(&self, number: usize, components: usize) -> Result<Vec<f64>> {
        let accessor = self.item("accessors", number)?;
        if accessor.get("sparse").is_some() {
            bail!("accessor {number} is sparse, which is not read");
        }
        let expected = ["", "SCALAR", "VEC2", "VEC3"][components];
        let kind = accessor.get("type").and_then(Value::as_str).unwrap_or_default();
        if kind != expected {
            bail!("accessor {number} is of the type {kind:?}, expected {expected}");
        }
        let (size, largest) = match whole(accessor, "componentType") {
            Some(5121) => (1, 255.0),
            Some(5123) => (2, 65535.0),
            Some(5125) => (4, 4_294_967_295.0),
            Some(5126) => (4, 0.0),
            other => bail!("accessor {number} has the component type {other:?}, which is not read"),
        };
        let normalised = accessor.get("normalized").and_then(Value::as_bool).unwrap_or(false);
        let count = whole(accessor, "count").unwrap_or(0);
        if count > MOST_ELEMENTS {
            bail!("accessor {number} has {count} elements, at most {MOST_ELEMENTS} are read");
        }
        let view = whole(accessor, "bufferView").ok_or_else(|| anyhow!("accessor {number} has no data"))?;
        let (bytes, stride) = self.view(view)?;
        let (start, stride) = (
            whole(accessor, "byteOffset").unwrap_or(0),
            stride.unwrap_or(size * components),
        );
        if stride < size * components {
            bail!("accessor {number}: its elements overlap");
        }
        // Before memory is asked for: the last element must be there.
        let last = count
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|last| last.checked_add(start));
        let end = last.and_then(|last| last.checked_add(size * components));
        if count > 0 && end.is_none_or(|end| end > bytes.len()) {
            bail!("accessor {number} reaches beyond its data: the file is cut short");
        }
        let mut values = Vec::with_capacity(count * components);
        for element in 0..count {
            for component in 0..components {
                let at = start + element * stride + component * size;
                let word = (bytes.get(at..at + size))
                    .ok_or_else(|| anyhow!("accessor {number} reaches beyond its data: the file is cut short"))?;
                let mut four = [0; 4];
                four[..size].copy_from_slice(word);
                values.push(if largest == 0.0 {
                    f64::from(f32::from_le_bytes(four))
                } else {
                    let value = f64::from(u32::from_le_bytes(four));
                    if normalised { value / largest } else { value }
                });
            }
        }
        Ok(values)
    }
}

/// The JSON and the binary chunk of a `.glb`.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let chunk = |at: usize, kind: u32| -> Option<(&[u8], usize)> {
        let (length, found) = (word(at)? as usize, word(at + 4)?);
        let content = bytes.get(at + 8..(at + 8).checked_add(length)?)?;
        (found == kind).then_some((content, at + 8 + length))
    };
    if word(4) != Some(2) {
        bail!("it is binary glTF of another version than 2");
    }
    // "JSON" and "BIN\0".
    let (json, next) = chunk(12, 0x4e4f_534a).ok_or_else(|| anyhow!("it is cut short"))?;
    Ok((json, chunk(next, 0x004e_4942).map(|(content, _)| content)))
}

fn whole(of: &Value, field: &str) -> Option<usize> {
    of.get(field)?.as_u64().map(|value| value as usize)
}

fn indices(of: &Value, field: &str) -> Vec<usize> {
    let list = of.get(field).and_then(Value::as_array);
    list.into_iter()
        .flatten()
        .filter_map(Value::as_u64)
        .map(|index| index as usize)
        .collect()
}

fn numbers<const N: usize>(of: &Value, field: &str) -> Option<[f64; N]> {
    let list: Vec<f64> = of.get(field)?.as_array()?.iter().filter_map(Value::as_f64).collect();
    list.try_into().ok()
}

/// What has been read so far.
struct Reading<'a> {
    document: &'a Document<'a>,
    textures_wanted: bool,
    /// Images of the file that are textures already, and which.
    of_image: Vec<(usize, usize)>,
    textures: Vec<Picture>,
    parts: Vec<Part>,
    /// Nodes that have been read: each has one place in the tree.
    nodes: HashSet<usize>,
}

impl Reading<'_> {
    fn node(&mut self, number: usize, above: DMat4, depth: usize) -> Result<()> {
        if depth > DEEPEST_NODE || !self.nodes.insert(number) {
            bail!("its nodes are no tree: node {number} has two places or lies too deep");
        }
        let node = self.document.item("nodes", number)?;
        let own = match numbers::<16>(node, "matrix") {
            Some(matrix) => DMat4::from_cols_array(&matrix),
            None => DMat4::from_scale_rotation_translation(
                numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array),
                numbers(node, "rotation").map_or(DQuat::IDENTITY, DQuat::from_array),
                numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array),
            ),
        };
        let place = above * own;
        if let Some(mesh) = whole(node, "mesh") {
            let mesh = self.document.item("meshes", mesh)?;
            let name = mesh.get("name").and_then(Value::as_str).unwrap_or("mesh").to_owned();
            let primitives = mesh.get("primitives").and_then(Value::as_array);
            for primitive in primitives.into_iter().flatten() {
                let part = self
                    .part(&name, primitive, place)
                    .with_context(|| format!("its part {name:?}"))?;
                self.parts.push(part);
            }
        }
        for child in indices(node, "children") {
            self.node(child, place, depth + 1)?;
        }
        Ok(())
    }

    fn part(&mut self, name: &str, primitive: &Value, place: DMat4) -> Result<Part> {
        let mode = primitive.get("mode").and_then(Value::as_u64).unwrap_or(TRIANGLES);
        if mode != TRIANGLES {
            bail!("it is not made of triangles (mode {mode})");
        }
        let attribute = |attribute: &str| primitive.get("attributes").and_then(|all| whole(all, attribute));
        let base = match whole(primitive, "material") {
            Some(material) => (self.document.item("materials", material)?)
                .pointer("/pbrMetallicRoughness/baseColorTexture")
                .cloned(),
            None => None,
        };
        if let Some(transform) = base
            .as_ref()
            .and_then(|base| base.pointer("/extensions/KHR_texture_transform"))
        {
            bail!("its texture is moved by KHR_texture_transform ({transform}), which is not read: bake it");
        }
        let set = base.as_ref().and_then(|base| whole(base, "texCoord")).unwrap_or(0);
        let positions = attribute("POSITION").ok_or_else(|| anyhow!("it has no positions"))?;
        let uv = attribute(&format!("TEXCOORD_{set}"))
            .ok_or_else(|| anyhow!("it has no texture coordinates (TEXCOORD_{set}): a template needs them"))?;
        let positions: Vec<DVec3> = (self.document.accessor(positions, 3)?.chunks_exact(3))
            .map(|p| place.transform_point3(DVec3::from_slice(p)))
            .collect();
        let texture_coordinates: Vec<DVec2> = self
            .document
            .accessor(uv, 2)?
            .chunks_exact(2)
            .map(DVec2::from_slice)
            .collect();
        if texture_coordinates.len() != positions.len() {
            bail!(
                "{} texture coordinates for {} vertices",
                texture_coordinates.len(),
                positions.len()
            );
        }
        let corners: Vec<usize> = match whole(primitive, "indices") {
            Some(indices) => self
                .document
                .accessor(indices, 1)?
                .into_iter()
                .map(|index| index as usize)
                .collect(),
            None => (0..positions.len()).collect(),
        };
        if let Some(index) = corners.iter().find(|&&index| index >= positions.len()) {
            bail!("a face names vertex {index}, there are {}", positions.len());
        }
        // A mirrored node turns the faces over.
        let mirrored = place.determinant() < 0.0;
        let face = |c: &[usize]| {
            if mirrored {
                [c[0], c[2], c[1]]
            } else {
                [c[0], c[1], c[2]]
            }
        };
        let texture = match base.as_ref().and_then(|base| whole(base, "index")) {
            Some(texture) if self.textures_wanted => Some(self.texture(texture)?),
            _ => None,
        };
        Ok(Part {
            name: name.to_owned(),
            faces: corners.chunks_exact(3).map(face).collect(),
            positions,
            texture_coordinates,
            texture,
        })
    }

    /// The picture of texture `number`, read once.
    fn texture(&mut self, number: usize) -> Result<usize> {
        let source = whole(self.document.item("textures", number)?, "source");
        let image = source.ok_or_else(|| anyhow!("its texture {number} is neither PNG nor JPEG"))?;
        if let Some((_, known)) = self.of_image.iter().find(|(known, _)| *known == image) {
            return Ok(*known);
        }
        let described = self.document.item("images", image)?;
        let picture = match (
            described.get("uri").and_then(Value::as_str),
            whole(described, "bufferView"),
        ) {
            (Some(uri), _) if uri.starts_with("data:") => decode_picture(&self.document.content(uri)?)?,
            (Some(uri), _) => texture_beside(self.document.path, &uri.replace("%20", " "))?,
            (None, Some(view)) => {
                decode_picture(self.document.view(view)?.0).with_context(|| format!("its texture {number}"))?
            }
            (None, None) => bail!("its texture {number} is not there"),
        };
        self.textures.push(picture);
        self.of_image.push((image, self.textures.len() - 1));
        Ok(self.textures.len() - 1)
    }
}
