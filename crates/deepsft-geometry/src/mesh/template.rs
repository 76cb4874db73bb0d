//! The known object: rest shape and texture.

use super::surface_point::SurfaceLocator;
use super::topology::{Topology, texture_overlap};
use super::triangle_mesh::TriangleMesh;
use crate::error::{GeometryError, Result, TemplateError};
use crate::image::Picture;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Longest side of a grid cell of a thin shell's rest mesh, as a fraction of the sheet's diagonal.
const CELL_FRACTION: f64 = 1.0 / 36.0;

/// Largest angle of a cell of a label, rad: on a mesh of 72 cells a turn, 1/1000 of the radius is cut off.
const MAX_CELL_ANGLE: f64 = TAU / 72.0;

/// Fraction of the used texture that may belong to several faces: charts that touch within a texel.
const MAX_OVERLAP: f64 = 0.02;

/// How far outside the unit square a texture coordinate counts as rounding.
const TEXTURE_ROUNDING: f64 = 1e-6;

/// A known object: its rest mesh and its texture.
///
/// Two kinds. A *sheet* ([`Template::thin_shell`]) is flat, rectangular and has a picture from edge to edge of its front;
/// its rest mesh is a regular grid in the plane z = 0 of the template frame, centred on the origin (see the crate
/// documentation for the axes). A *mesh* ([`Template::of_mesh`]) is any textured triangle mesh: open or closed, of any
/// number of charts and seams.
#[derive(Clone, Debug)]
pub struct Template {
    shape: Shape,
    size_mm: DVec2,
    mesh: TriangleMesh,
    /// Shared by clones: the finders and the fit of a target each have one.
    texture: Arc<Picture>,
}

#[derive(Clone, Debug)]
enum Shape {
    /// Vertices across and down.
    Sheet { columns: usize, rows: usize },
    /// From texture to surface; shared by clones.
    Mesh(Arc<SurfaceLocator>),
}

impl Template {
    /// A sheet of `width_mm` x `height_mm` that carries `texture` from edge to edge.
    ///
    /// # Errors
    /// [`TemplateError::Size`] when a side is not positive and finite.
    pub fn thin_shell(texture: Picture, width_mm: f64, height_mm: f64) -> Result<Self, TemplateError> {
        check_sizes([("width", width_mm), ("height", height_mm)])?;
        let cell = width_mm.hypot(height_mm) * CELL_FRACTION;
        Self::with_cells(texture, DVec2::new(width_mm, height_mm), cell)
    }

    /// Makes a template of any shape from its rest mesh, which carries `texture`. The mesh is in mm, template frame,
    /// faces counter-clockwise seen from outside. Vertices on a seam stand in it once for each chart, at exactly the
    /// same position.
    ///
    /// Tolerated: borders, several pieces, edges of more than two faces, faces without area in the texture.
    ///
    /// # Errors
    /// * [`TemplateError::MeshWithoutFaces`], [`TemplateError::UnusedVertex`], [`TemplateError::DegenerateFace`] (no area
    ///   in space): what cannot be deformed.
    /// * [`TemplateError::TextureOutside`] beyond the unit square, [`TemplateError::ChartsOverlap`] when 2 % of the
    ///   texture or more belong to several places of the surface: what cannot be registered.
    /// * [`TemplateError::FaceOrientation`]: front and back are not told apart.
    pub fn of_mesh(mesh: TriangleMesh, texture: Picture) -> Result<Self, TemplateError> {
        if mesh.faces().is_empty() {
            return Err(TemplateError::MeshWithoutFaces);
        }
        let mut used = vec![false; mesh.vertices().len()];
        for (face, corners) in mesh.faces().iter().enumerate() {
            let [a, b, c] = corners.map(|v| mesh.vertices()[v]);
            if (b - a).cross(c - a) == DVec3::ZERO {
                return Err(TemplateError::DegenerateFace(face));
            }
            corners.iter().for_each(|&v| used[v] = true);
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(TemplateError::UnusedVertex(vertex));
        }
        let unit = |uv: &DVec2| uv.clamp(DVec2::ZERO, DVec2::ONE);
        let outside = |uv: &DVec2| uv.distance(unit(uv)) > TEXTURE_ROUNDING;
        if let Some(vertex) = mesh.texture_coordinates().iter().position(outside) {
            let uv = mesh.texture_coordinates()[vertex];
            return Err(TemplateError::TextureOutside(vertex, uv));
        }
        Topology::of(&mesh)?;
        let overlap = texture_overlap(&mesh);
        if overlap >= MAX_OVERLAP {
            return Err(TemplateError::ChartsOverlap(100.0 * overlap));
        }
        let texture_coordinates = mesh.texture_coordinates().iter().map(unit).collect();
        let mesh = TriangleMesh::new(mesh.vertices().to_vec(), texture_coordinates, mesh.faces().to_vec())?;
        Ok(Self {
            shape: Shape::Mesh(Arc::new(SurfaceLocator::new(&mesh))),
            size_mm: texture_scale(&mesh),
            mesh,
            texture: Arc::new(texture),
        })
    }

    /// The same sheet with `times` as large cells and no picture.
    ///
    /// # Errors
    /// [`GeometryError::NotASheet`] for a template of another shape.
    pub fn coarser(&self, times: usize) -> Result<Self> {
        self.expect_sheet("a coarser grid")?;
        let cell = self.size_mm.length() * CELL_FRACTION * times as f64;
        // Nothing is drawn with it.
        let picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
        Ok(Self::with_cells(picture, self.size_mm, cell)?)
    }

    pub(crate) fn expect_sheet(&self, operation: &'static str) -> Result<(usize, usize)> {
        self.grid().ok_or(GeometryError::NotASheet(operation))
    }

    fn with_cells(texture: Picture, size_mm: DVec2, cell: f64) -> Result<Self, TemplateError> {
        Self::of_grid(Arc::new(texture), size_mm, grid_of(size_mm, cell))
    }

    /// Subdivides the sheet's grid: every cell is cut into four. A method that fits the ordinary mesh is tried on it,
    /// so that it does not find its own mesh again. Vertex (i, j) of this grid is vertex (2 i, 2 j) there.
    ///
    /// # Errors
    /// [`GeometryError::NotASheet`] for a template of another shape.
    pub fn finer(&self) -> Result<Self> {
        let (columns, rows) = self.expect_sheet("a finer grid")?;
        let grid = (2 * columns - 1, 2 * rows - 1);
        Ok(Self::of_grid(self.texture.clone(), self.size_mm, grid)?)
    }

    /// The same surface with another texture on it.
    pub fn with_texture(self, texture: Picture) -> Self {
        Self {
            texture: Arc::new(texture),
            ..self
        }
    }

    /// A label around a cylinder: a print of `width_mm` x `height_mm`, bent around a tin, a bottle or a tube of `diameter_mm`, its
    /// middle before the viewer and upright. A print longer than one turn covers its own end: what lies under its beginning is left out.
    ///
    /// # Errors
    /// [`TemplateError::Size`] when a length is not positive and finite.
    pub fn around_cylinder(texture: Picture, [width_mm, height_mm]: [f64; 2], diameter_mm: f64) -> Result<Self> {
        check_sizes([("width", width_mm), ("height", height_mm), ("diameter", diameter_mm)])?;
        let radius = diameter_mm / 2.0;
        let is_closed = width_mm > TAU * radius * (1.0 - TEXTURE_ROUNDING);
        let turn = if is_closed { TAU } else { width_mm / radius };
        let (columns, rows) = grid_of(
            DVec2::new(width_mm, height_mm),
            width_mm.hypot(height_mm) * CELL_FRACTION,
        );
        let grid = (columns.max((turn / MAX_CELL_ANGLE).ceil() as usize + 1), rows);
        let place = |across: f64, v: f64| {
            // The two ends of a whole turn are the same bits: a seam.
            let around = if is_closed && across == 1.0 { 0.0 } else { across };
            let (sin, cos) = ((around - 0.5) * turn).sin_cos();
            DVec3::new(radius * sin, (v - 0.5) * height_mm, -radius * cos)
        };
        let mesh = grid_mesh(grid, turn * radius / width_mm, place)?;
        Ok(Self::of_mesh(mesh, texture)?)
    }

    /// A sheet whose mesh has `columns` x `rows` vertices, at least two each.
    fn of_grid(texture: Arc<Picture>, size_mm: DVec2, (columns, rows): (usize, usize)) -> Result<Self, TemplateError> {
        let place = |u: f64, v: f64| ((DVec2::new(u, v) - 0.5) * size_mm).extend(0.0);
        Ok(Self {
            shape: Shape::Sheet { columns, rows },
            size_mm,
            mesh: grid_mesh((columns, rows), 1.0, place)?,
            texture,
        })
    }

    /// Millimetres that a difference of 1 in u and in v covers: width and height of a sheet. For other templates the
    /// median over the surface, so that a small error of the registration times this is about its length on the surface.
    /// The median, because scans have faces that are nearly lines in the texture and would outweigh all others in a mean.
    pub fn size_mm(&self) -> DVec2 {
        self.size_mm
    }

    /// Sides of the rest mesh's bounding box, mm.
    pub fn extent_mm(&self) -> DVec3 {
        let [low, high] = self.bounds();
        high - low
    }

    /// The corners of the rest mesh's bounding box, mm, template frame.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let vertices = || self.mesh.vertices().iter().copied();
        [
            vertices().fold(DVec3::INFINITY, DVec3::min),
            vertices().fold(DVec3::NEG_INFINITY, DVec3::max),
        ]
    }

    /// Whether it is a flat sheet.
    pub fn is_sheet(&self) -> bool {
        self.grid().is_some()
    }

    /// Vertices (columns, rows) of a sheet's grid; vertex (i, j) has index j * columns + i. `None` for a template of
    /// another shape.
    pub fn grid(&self) -> Option<(usize, usize)> {
        match self.shape {
            Shape::Sheet { columns, rows } => Some((columns, rows)),
            Shape::Mesh(_) => None,
        }
    }

    /// The rest mesh, mm, template frame. Faces are counter-clockwise seen from the front (a sheet's -z side), to
    /// which their normals (b - a) x (c - a) point.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The texture: a sheet's picture.
    pub fn texture(&self) -> &Picture {
        &self.texture
    }

    /// The point of the rest shape at texture position `uv`, mm, template frame. A sheet's plane goes on beyond its
    /// edges; of other templates `None` where the texture belongs to no face.
    pub fn point_template(&self, uv: DVec2) -> Option<DVec3> {
        match &self.shape {
            Shape::Sheet { .. } => Some(((uv - 0.5) * self.size_mm).extend(0.0)),
            Shape::Mesh(locator) => {
                let point = locator.locate(uv)?;
                Some(point.position(self.mesh.faces(), self.mesh.vertices()))
            }
        }
    }
}

fn check_sizes<const N: usize>(sizes: [(&'static str, f64); N]) -> Result<(), TemplateError> {
    let is_length = |actual: f64| actual.is_finite() && actual > 0.0;
    let wrong = sizes.into_iter().find(|&(_, actual)| !is_length(actual));
    wrong.map_or(Ok(()), |(side, actual)| Err(TemplateError::Size { side, actual }))
}

/// Vertices across and down of a grid whose cells have about the side `cell`.
fn grid_of(size_mm: DVec2, cell: f64) -> (usize, usize) {
    let cells = |side: f64| ((side / cell).ceil() as usize).clamp(2, 64);
    (cells(size_mm.x) + 1, cells(size_mm.y) + 1)
}

/// A grid of `columns` x `rows` vertices over the texture up to `u_end`; a vertex is at `place` of the fractions across and down.
fn grid_mesh(
    (columns, rows): (usize, usize),
    u_end: f64,
    place: impl Fn(f64, f64) -> DVec3,
) -> Result<TriangleMesh, TemplateError> {
    let mut vertices = Vec::with_capacity(columns * rows);
    let mut texture_coordinates = Vec::with_capacity(columns * rows);
    for j in 0..rows {
        for i in 0..columns {
            let (across, v) = (i as f64 / (columns - 1) as f64, j as f64 / (rows - 1) as f64);
            texture_coordinates.push(DVec2::new(across * u_end, v));
            vertices.push(place(across, v));
        }
    }
    let mut faces = Vec::with_capacity(2 * (columns - 1) * (rows - 1));
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let (a, b) = (j * columns + i, j * columns + i + 1);
            let (c, d) = (a + columns, b + columns);
            // The diagonal alternates so that no bending direction is preferred.
            if (i + j) % 2 == 0 {
                faces.extend([[a, c, d], [a, d, b]]);
            } else {
                faces.extend([[a, c, b], [b, c, d]]);
            }
        }
    }
    TriangleMesh::new(vertices, texture_coordinates, faces)
}

/// Medians over the surface, by area, of the millimetres that a difference of 1 in u and in v covers.
fn texture_scale(mesh: &TriangleMesh) -> DVec2 {
    // Length along u, along v, and area of each face.
    let of_face = |face: &[usize; 3]| {
        let ([by_u, by_v], normal, _) = mesh.texture_derivatives(*face)?;
        Some([by_u.length(), by_v.length(), normal.length()])
    };
    let mut scales: Vec<[f64; 3]> = mesh.faces().iter().filter_map(of_face).collect();
    let half = scales.iter().map(|face| face[2]).sum::<f64>() / 2.0;
    let mut median = |axis: usize| {
        scales.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
        let mut below = 0.0;
        let middle = scales.iter().find(|face| {
            below += face[2];
            below >= half
        });
        middle.map_or(1.0, |face| face[axis])
    };
    DVec2::new(median(0), median(1))
}
