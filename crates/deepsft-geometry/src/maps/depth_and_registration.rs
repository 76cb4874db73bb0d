//! Depth and registration maps.

use crate::error::{GeometryError, Result};
use crate::image::{ImageSize, turned_anticlockwise};
use glam::DVec2;

/// Value of depth and of both registration coordinates outside the object.
pub const OUTSIDE: f32 = -1.0;

/// What the camera sees of the object: for every pixel its depth in mm and its texture position.
/// Row-major; outside the object depth is -1 and registration (-1, -1).
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    size: ImageSize,
    depth: Vec<f32>,
    registration: Vec<[f32; 2]>,
}

impl Maps {
    /// Maps of this size in which nothing is seen.
    pub fn empty(size: impl Into<ImageSize>) -> Self {
        let size = size.into();
        Self {
            size,
            depth: vec![OUTSIDE; size.area()],
            registration: vec![[OUTSIDE; 2]; size.area()],
        }
    }

    /// Takes both maps, row-major.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when a map does not have `width * height` entries.
    pub fn new(width: usize, height: usize, depth: Vec<f32>, registration: Vec<[f32; 2]>) -> Result<Self> {
        let size = ImageSize { width, height };
        for length in [depth.len(), registration.len()] {
            if length != size.area() {
                return Err(GeometryError::MapSize {
                    actual: (length, 1).into(),
                    expected: size,
                });
            }
        }
        Ok(Self {
            size,
            depth,
            registration,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// Texture position at row-major index `pixel`.
    pub fn uv(&self, pixel: usize) -> DVec2 {
        self.registration[pixel].map(f64::from).into()
    }

    /// Depth (camera-frame z) in mm, -1 outside.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// Registration (u, v), (-1, -1) outside.
    pub fn registration(&self) -> &[[f32; 2]] {
        &self.registration
    }

    /// Depths and registration, row-major, to be written.
    pub fn parts_mut(&mut self) -> (&mut [f32], &mut [[f32; 2]]) {
        (&mut self.depth, &mut self.registration)
    }

    /// Sets the pixel with row-major index `pixel`.
    pub fn set(&mut self, pixel: usize, depth_mm: f32, uv: [f32; 2]) {
        self.depth[pixel] = depth_mm;
        self.registration[pixel] = uv;
    }

    /// Marks the pixel with row-major index `pixel` as outside the object.
    pub fn clear(&mut self, pixel: usize) {
        self.set(pixel, OUTSIDE, [OUTSIDE; 2]);
    }

    /// Restricts these maps to the mask of `seen`, maps of the same size. What they show outside it is cleared, and
    /// what they lack inside it is that of `seen`. A mesh is drawn whole, `seen` knows what lies in front of it.
    #[must_use]
    pub fn within(mut self, seen: &Self) -> Self {
        for pixel in 0..self.depth.len().min(seen.depth.len()) {
            match (seen.inside(pixel), self.inside(pixel)) {
                (true, false) => self.set(pixel, seen.depth[pixel], seen.registration[pixel]),
                (false, true) => self.clear(pixel),
                _ => {}
            }
        }
        self
    }

    /// Multiplies the depths inside the object.
    pub fn scale_depth(&mut self, factor: f32) {
        for depth in self.depth.iter_mut().filter(|depth| **depth > OUTSIDE) {
            *depth *= factor;
        }
    }

    /// These maps turned by a quarter anticlockwise. Depth and registration do not depend on how a camera is rolled.
    #[must_use]
    pub fn turned_anticlockwise(&self) -> Self {
        let ImageSize { width, height } = self.size;
        Self {
            size: (height, width).into(),
            depth: turned_anticlockwise(&self.depth, width),
            registration: turned_anticlockwise(&self.registration, width),
        }
    }

    /// Whether the object is seen at row-major index `pixel`: depth above -1.
    pub fn inside(&self, pixel: usize) -> bool {
        self.depth[pixel] > OUTSIDE
    }

    /// One flag per pixel: whether the object is seen there.
    pub fn mask(&self) -> Vec<bool> {
        self.depth.iter().map(|&d| d > OUTSIDE).collect()
    }

    /// Number of pixels in which the object is seen.
    pub fn area(&self) -> usize {
        self.depth.iter().filter(|&&d| d > OUTSIDE).count()
    }
}
