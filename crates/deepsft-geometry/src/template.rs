//! The known object: rest shape and texture.

use crate::{GeometryError, Picture, TriangleMesh};
use glam::{DVec2, DVec3};

/// Longest side of a grid cell of a thin shell's rest mesh, as a share of the sheet's diagonal.
const CELL_SHARE: f64 = 1.0 / 36.0;

/// A thin-shell template: a flat rectangular sheet with a picture printed on its front.
///
/// The rest mesh is a regular grid in the plane z = 0 of the template frame, centred on the origin
/// (see the crate documentation for the axes).
#[derive(Clone, Debug)]
pub struct Template {
    width_mm: f64,
    height_mm: f64,
    columns: usize,
    rows: usize,
    mesh: TriangleMesh,
    texture: Picture,
}

impl Template {
    /// A sheet of `width_mm` x `height_mm` that carries `texture` from edge to edge.
    ///
    /// # Errors
    /// [`GeometryError::TemplateSize`] when a side is not positive and finite.
    pub fn thin_shell(texture: Picture, width_mm: f64, height_mm: f64) -> Result<Self, GeometryError> {
        for (side, actual) in [("width", width_mm), ("height", height_mm)] {
            if !(actual.is_finite() && actual > 0.0) {
                return Err(GeometryError::TemplateSize { side, actual });
            }
        }
        Self::with_cells(texture, width_mm, height_mm, width_mm.hypot(height_mm) * CELL_SHARE)
    }

    /// The same sheet with `times` as large cells.
    pub(crate) fn coarser(&self, times: usize) -> Result<Self, GeometryError> {
        let cell = self.size_mm().length() * CELL_SHARE * times as f64;
        // Nothing is drawn with it.
        Self::with_cells(
            Picture::from_fn(1, 1, |_, _| [0; 3]),
            self.width_mm,
            self.height_mm,
            cell,
        )
    }

    fn with_cells(texture: Picture, width_mm: f64, height_mm: f64, cell: f64) -> Result<Self, GeometryError> {
        let cells = |side: f64| ((side / cell).ceil() as usize).clamp(2, 64);
        let (columns, rows) = (cells(width_mm) + 1, cells(height_mm) + 1);
        let mut vertices = Vec::with_capacity(columns * rows);
        let mut texture_coordinates = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let uv = DVec2::new(i as f64 / (columns - 1) as f64, j as f64 / (rows - 1) as f64);
                texture_coordinates.push(uv);
                vertices.push(DVec3::new((uv.x - 0.5) * width_mm, (uv.y - 0.5) * height_mm, 0.0));
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
        let mesh = TriangleMesh::new(vertices, texture_coordinates, faces)?;
        Ok(Self {
            width_mm,
            height_mm,
            columns,
            rows,
            mesh,
            texture,
        })
    }

    /// Width and height of the sheet, mm.
    pub fn size_mm(&self) -> DVec2 {
        DVec2::new(self.width_mm, self.height_mm)
    }

    /// Vertices (columns, rows) of the rest mesh's grid; vertex (i, j) has index j * columns + i.
    pub fn grid(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// The rest mesh, mm, template frame. Faces are counter-clockwise seen from the front (-z side),
    /// so their normals (b - a) x (c - a) point to -z.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The picture on the front.
    pub fn texture(&self) -> &Picture {
        &self.texture
    }

    /// The point of the flat sheet at texture position `uv`, mm, template frame.
    pub fn point_template(&self, uv: DVec2) -> DVec3 {
        ((uv - 0.5) * self.size_mm()).extend(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Template {
        Template::thin_shell(Picture::from_fn(4, 3, |x, y| [x as u8, y as u8, 0]), 297.0, 210.0).unwrap()
    }

    #[test]
    fn the_grid_is_centred_and_its_faces_look_at_minus_z() {
        let template = sheet();
        let mesh = template.mesh();
        let (columns, rows) = template.grid();
        assert_eq!(mesh.vertices().len(), columns * rows);
        assert_eq!(mesh.vertices()[0], DVec3::new(-148.5, -105.0, 0.0));
        assert_eq!(
            template.point_template(DVec2::new(1.0, 0.5)),
            DVec3::new(148.5, 0.0, 0.0)
        );
        let mut area = 0.0;
        for &[a, b, c] in mesh.faces() {
            let v = mesh.vertices();
            let normal = (v[b] - v[a]).cross(v[c] - v[a]);
            assert!(normal.z < 0.0);
            area += normal.length() / 2.0;
        }
        assert!((area - 297.0 * 210.0).abs() < 1e-6);
    }

    #[test]
    fn a_sheet_without_a_size_is_refused() {
        for width in [0.0, -3.0, f64::NAN, f64::INFINITY] {
            let picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
            assert!(matches!(
                Template::thin_shell(picture, width, 10.0),
                Err(GeometryError::TemplateSize { side: "width", .. })
            ));
        }
    }
}
