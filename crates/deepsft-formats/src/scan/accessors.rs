//! The numbers in the buffers of a glTF file.
//!
//! The crate `gltf` can read them too, but trusts what a file says of lengths and types: these are checked here.

use super::{Textures, refused};
use crate::error::FormatError;
use base64::Engine;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::root::Get;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Index, Root, buffer};
use percent_encoding::percent_decode_str;

/// Most elements that are read of all accessors together, each as often as it is used.
const MAX_ELEMENTS: u64 = 20_000_000;

/// Most bytes of all buffers together.
const MAX_BUFFER_BYTES: usize = 1 << 30;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    buffers: Vec<Vec<u8>>,
    /// Elements read so far.
    elements: u64,
}

impl<'a> Buffers<'a> {
    /// The buffers of `root`: data within it, files beside it, or the binary chunk.
    pub(super) fn new(root: &'a Root, binary: Option<&[u8]>, textures: &mut Textures<'_>) -> Result<Self, FormatError> {
        let mut buffers: Vec<Vec<u8>> = Vec::new();
        let mut total = 0_usize;
        for (number, buffer) in root.buffers.iter().enumerate() {
            let bytes = match (&buffer.uri, binary) {
                (Some(uri), _) => {
                    content(uri, textures).or_else(|error| refused(format!("its buffer {number}: {error}")))?
                }
                (None, Some(binary)) if number == 0 => binary.to_vec(),
                _ => return refused(format!("its buffer {number} is not there")),
            };
            total = total.saturating_add(bytes.len());
            if total > MAX_BUFFER_BYTES {
                return refused("its buffers have more than 1 GiB: make it coarser");
            }
            buffers.push(bytes);
        }
        Ok(Self {
            root,
            buffers,
            elements: 0,
        })
    }

    /// The bytes of a buffer view, and the distance between its elements if it says one.
    pub(super) fn view(&self, index: Index<buffer::View>) -> Result<(&[u8], Option<usize>), FormatError> {
        let view = named(self.root, index, "buffer view")?;
        let Some(buffer) = self.buffers.get(view.buffer.value()) else {
            return refused(format!("buffer view {index} has no buffer"));
        };
        let start = whole(view.byte_offset.unwrap_or_default());
        let end = start.checked_add(whole(view.byte_length));
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        match end.and_then(|end| buffer.get(start..end)) {
            Some(bytes) => Ok((bytes, stride)),
            None => refused(format!(
                "buffer view {index} reaches beyond its buffer: the file is cut short or damaged, export it again"
            )),
        }
    }

    /// The elements of an accessor of vectors of N numbers (of N = 1: of numbers).
    pub(super) fn elements<const N: usize>(&mut self, index: Index<Accessor>) -> Result<Vec<[f64; N]>, FormatError> {
        let accessor = named(self.root, index, "accessor")?;
        let kinds = [Type::Scalar, Type::Vec2, Type::Vec3, Type::Vec4];
        if accessor.type_ != Checked::Valid(kinds[N - 1]) {
            return refused(format!("accessor {index} is not of the type {:?}", kinds[N - 1]));
        }
        if accessor.sparse.is_some() {
            return refused(format!(
                "accessor {index} is sparse, which is not read: export it without"
            ));
        }
        let component = match &accessor.component_type {
            Checked::Valid(component) => component.0,
            Checked::Invalid => return refused(format!("accessor {index} has no component type")),
        };
        if let ComponentType::I8 | ComponentType::I16 = component {
            let reason = format!("accessor {index} has the component type {component:?}, which is not read");
            return refused(reason);
        }
        let size = component.size();
        let Some(view) = accessor.buffer_view else {
            return refused(format!("accessor {index} has no data"));
        };
        let count = accessor.count.0;
        self.elements = self.elements.saturating_add(count);
        if count == 0 {
            return Ok(Vec::new());
        }
        let (bytes, stride) = self.view(view)?;
        let (start, length) = (accessor.byte_offset.unwrap_or_default().0, (N * size) as u64);
        let stride = stride.map_or(length, |stride| stride as u64);
        if stride < length {
            return refused(format!("accessor {index}: its elements overlap"));
        }
        // Before memory is asked for: the last element must be there.
        let last = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(start));
        let end = last.and_then(|last| last.checked_add(length));
        if end.is_none_or(|end| end > bytes.len() as u64) {
            return refused(format!(
                "accessor {index} reaches beyond its data: the file is cut short or damaged, export it again"
            ));
        }
        if self.elements > MAX_ELEMENTS {
            return refused(format!(
                "it has more than {MAX_ELEMENTS} vertices and corners of faces: make it coarser"
            ));
        }
        // Of normalised whole numbers the largest is 1.
        let scale = if accessor.normalized {
            ((1_u64 << (8 * size)) - 1) as f64
        } else {
            1.0
        };
        let number = |word: &[u8]| -> f64 {
            let mut four = [0; 4];
            four[..size].copy_from_slice(word);
            match component {
                ComponentType::F32 => f64::from(f32::from_le_bytes(four)),
                _ => f64::from(u32::from_le_bytes(four)) / scale,
            }
        };
        let element = |element: &[u8]| std::array::from_fn(|k| number(&element[k * size..(k + 1) * size]));
        let elements = bytes[start as usize..].chunks(stride as usize).take(count as usize);
        Ok(elements.map(element).collect())
    }
}

/// What a document has at an index, a `what` ("node").
pub(super) fn named<'a, T>(root: &'a Root, index: Index<T>, what: &str) -> Result<&'a T, FormatError>
where
    Root: Get<T>,
{
    let missing = || FormatError::Scan(format!("it names {what} {index}, which is not there"));
    root.get(index).ok_or_else(missing)
}

/// The bytes that a URI stands for: data within it, or a file beside the scan.
pub(super) fn content(uri: &str, textures: &mut Textures<'_>) -> Result<Vec<u8>, FormatError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, coded)) = data.split_once(";base64,") else {
            return refused("a data URI is not base64");
        };
        return (base64::engine::general_purpose::STANDARD.decode(coded))
            .or_else(|error| refused(format!("a data URI cannot be read: {error}")));
    }
    match percent_decode_str(uri).decode_utf8() {
        Ok(name) => textures.file(&name),
        Err(_) => refused(format!("it names {uri:?}, which is no UTF-8")),
    }
}

fn whole(number: USize64) -> usize {
    // What does not fit lies beyond every buffer.
    usize::try_from(number.0).unwrap_or(usize::MAX)
}
