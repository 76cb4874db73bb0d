//! The parts of a scan as one surface: welded, mended, in our axes.

use super::mending::{bits, mended};
use super::{ScanPart, Wrap, refused};
use crate::error::FormatError;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{TemplateError, Topology, TriangleMesh};
use std::collections::{HashMap, HashSet};

/// Fraction of the faces that lie on others from which on these are left out.
const DOUBLES: f64 = 0.01;

/// A point of the surface as one of its faces has it.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// mm, template frame.
    pub(super) position: DVec3,
    /// Where its colour is in its texture, v down.
    pub(super) uv: DVec2,
    /// sRGB, by which that of its texture is multiplied.
    pub(super) color: [u8; 3],
    /// Number of its paint.
    paint: usize,
}

/// Where the colours of faces come from: a texture and how it goes on, or no texture.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Paint {
    pub(super) texture: Option<usize>,
    pub(super) wraps: [Wrap; 2],
}

/// The surface of a scan, with the colours of its file.
#[derive(Default)]
pub(super) struct Surface {
    pub(super) vertices: Vec<Vertex>,
    /// Corners; all of a face have the same paint.
    pub(super) faces: Vec<[usize; 3]>,
    paints: Vec<Paint>,
    known: HashMap<[u64; 6], usize>,
    dropped: usize,
}

impl Surface {
    /// The surface of `parts`, its middle at the origin. What was put right is told in `notes`.
    pub(super) fn of(parts: &[ScanPart], mm_per_unit: f64, notes: &mut Vec<String>) -> Result<Self, FormatError> {
        let mut raw = Self::default();
        let mut broken = 0;
        for part in parts {
            let paint = raw.paint(part);
            let vertex = |i: usize| Vertex {
                // y up and the viewer on the +z side become y down and the viewer on the -z side.
                position: part.positions[i] * DVec3::new(1.0, -1.0, -1.0) * mm_per_unit,
                uv: part.texture_coordinates[i],
                color: part.colors.get(i).copied().unwrap_or([255; 3]),
                paint,
            };
            for face in &part.faces {
                let corners = face.map(vertex);
                if corners.iter().all(|at| at.position.is_finite() && at.uv.is_finite()) {
                    raw.add(corners);
                } else {
                    broken += 1;
                }
            }
        }
        let mut note = |count: usize, words: &str| {
            if count > 0 {
                notes.push(format!("{count} {words}"));
            }
        };
        note(
            broken,
            "faces have vertices that are no finite numbers and were left out",
        );
        note(raw.dropped, "faces without area were left out");
        note(raw.leave_doubles_out(), "faces that lie on others were left out");
        if raw.faces.is_empty() {
            return refused("none of its faces has an area: export it again");
        }
        let faces = mended(&raw.positions(), &raw.faces, &mut note);
        // Without the vertices of what was left out.
        let mut surface = Self {
            paints: raw.paints,
            ..Self::default()
        };
        (faces.iter()).for_each(|face| surface.add(face.map(|v| raw.vertices[v])));
        surface.known.clear();
        surface.center();
        if surface.turn_outside()? {
            notes.push("the fronts of its faces were inside and have been turned outside".to_owned());
        }
        Ok(surface)
    }

    pub(super) fn paint_of(&self, vertex: &Vertex) -> Paint {
        self.paints[vertex.paint]
    }

    pub(super) fn texture_of(&self, vertex: &Vertex) -> Option<usize> {
        self.paint_of(vertex).texture
    }

    pub(super) fn corners(&self, face: usize) -> [Vertex; 3] {
        self.faces[face].map(|v| self.vertices[v])
    }

    /// A normal of a face, as long as twice its area, mm².
    pub(super) fn normal(&self, face: usize) -> DVec3 {
        let [a, b, c] = self.corners(face).map(|at| at.position);
        (b - a).cross(c - a)
    }

    /// Twice the area of a face in its texture, (u, v): negative as its print is seen from its front, positive where the print is mirrored.
    pub(super) fn texture_area(&self, face: usize) -> f64 {
        let [a, b, c] = self.corners(face).map(|at| at.uv);
        (b - a).perp_dot(c - a)
    }

    /// Its mesh with other texture coordinates.
    pub(super) fn mesh(&self, texture_coordinates: Vec<DVec2>) -> Result<TriangleMesh, TemplateError> {
        TriangleMesh::new(self.positions(), texture_coordinates, self.faces.clone())
    }

    /// Positions of its vertices.
    pub(super) fn positions(&self) -> Vec<DVec3> {
        self.vertices.iter().map(|at| at.position).collect()
    }

    fn paint(&mut self, part: &ScanPart) -> usize {
        let paint = Paint {
            texture: part.texture,
            wraps: part.wraps,
        };
        let known = self.paints.iter().position(|other| *other == paint);
        known.unwrap_or_else(|| {
            self.paints.push(paint);
            self.paints.len() - 1
        })
    }

    /// Leaves out faces on the corners of others, as of models that have every face once for each side. A few are flaps of a scan, and stay.
    fn leave_doubles_out(&mut self) -> usize {
        let mut known = HashSet::new();
        let mut is_first = |face: &[usize; 3]| {
            let mut corners = face.map(|v| bits(self.vertices[v].position));
            corners.sort_unstable();
            known.insert(corners)
        };
        let firsts: Vec<[usize; 3]> = self.faces.iter().copied().filter(|face| is_first(face)).collect();
        let doubles = self.faces.len() - firsts.len();
        if (doubles as f64) < DOUBLES * self.faces.len() as f64 {
            return 0;
        }
        self.faces = firsts;
        doubles
    }

    /// Adds a face: vertices that are equal become one. Faces without area are left out.
    fn add(&mut self, corners: [Vertex; 3]) {
        let [a, b, c] = corners.map(|at| at.position);
        if (b - a).cross(c - a) == DVec3::ZERO {
            self.dropped += 1;
            return;
        }
        let face = corners.map(|at| {
            let ([x, y, z], [r, g, b]) = (bits(at.position), at.color.map(u64::from));
            let [u, v] = at.uv.to_array().map(|number| (number + 0.0).to_bits());
            let key = [x, y, z, u, v, (at.paint as u64) << 24 | r << 16 | g << 8 | b];
            *self.known.entry(key).or_insert_with(|| {
                self.vertices.push(at);
                self.vertices.len() - 1
            })
        });
        self.faces.push(face);
    }

    fn center(&mut self) {
        let positions = || self.vertices.iter().map(|at| at.position);
        let (low, high) = positions().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let middle = (low + high) / 2.0;
        self.vertices.iter_mut().for_each(|at| at.position -= middle);
    }

    /// Turns the faces of a closed surface whose fronts are inside.
    fn turn_outside(&mut self) -> Result<bool, FormatError> {
        let topology = Topology::of(&self.mesh(self.vertices.iter().map(|at| at.uv).collect())?)?;
        let volume = |face: usize| {
            let [a, b, c] = self.corners(face).map(|at| at.position);
            a.dot(b.cross(c))
        };
        let is_inside = topology.border_edges == 0 && (0..self.faces.len()).map(volume).sum::<f64>() < 0.0;
        if is_inside {
            self.faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        Ok(is_inside)
    }
}
