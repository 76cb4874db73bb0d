//! What completion is studied on: objects of which a camera sees a part.

use super::interpolation::{laplacian, rigid};
use super::partial_view::PartialView;
use crate::poster::{POSTER_HEIGHT_MM, POSTER_WIDTH_MM};
use anyhow::Result;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::solver::VertexPoint;
use deepsft_geometry::{
    ArapCompletion, Camera, CompletionOptions, Picture, Template, TriangleMesh, VisibleVertices, Welding,
};
use deepsft_synth::{SynthConfig, Synthesizer, capsule, edge_length_change};
use serde::Serialize;

/// Hidden fractions that are drawn, of a sheet's vertices and of a closed mesh's, whose back is always hidden.
const SHEET_HIDDEN: [f64; 2] = [0.3, 0.7];
const CLOSED_HIDDEN: [f64; 2] = [0.5, 0.7];

/// The closed mesh: length and radius in mm, vertices from pole to pole and around.
const CLOSED_MM: [f64; 2] = [240.0, 30.0];
const CLOSED_VERTICES: [usize; 2] = [41, 24];

/// An object whose hidden parts are completed.
pub struct Object {
    pub name: &'static str,
    pub mesh: TriangleMesh,
    pub welding: Welding,
    /// Largest extent of the rest shape, mm.
    pub extent: f64,
    hidden: [f64; 2],
    /// The sheet's bends; none for the closed mesh.
    synthesizer: Option<Synthesizer>,
}

/// The errors of one method on one frame.
#[derive(Clone, Copy, Serialize)]
pub struct FrameReport {
    pub index: u64,
    pub hidden_fraction: f64,
    /// RMSE of the hidden vertices, mm.
    pub arap_mm: f64,
    pub rigid_mm: f64,
    pub laplacian_mm: f64,
    /// RMSE of the visible vertices, mm.
    pub visible_before_mm: f64,
    pub visible_after_mm: f64,
    /// Relative change of edge lengths of the result, and of the truth.
    pub edge_change_median: f64,
    pub edge_change_p95: f64,
    pub true_edge_change_p95: f64,
    pub flipped: usize,
    pub true_flipped: usize,
    pub converged: bool,
}

/// A frame with its result.
pub struct Completed {
    pub report: FrameReport,
    pub view: PartialView,
    pub points: Vec<VertexPoint>,
    pub vertices: Vec<DVec3>,
}

impl Object {
    /// The A4 poster.
    pub fn poster() -> Result<Self> {
        let picture = Picture::from_fn(1, 1, |_, _| [255; 3]);
        let template = Template::thin_shell(picture, POSTER_WIDTH_MM, POSTER_HEIGHT_MM)?;
        let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
        Self::new("poster", template.mesh().clone(), SHEET_HIDDEN, Some(synthesizer))
    }

    /// The closed tube.
    pub fn closed() -> Result<Self> {
        let ([length, radius], [rings, around]) = (CLOSED_MM, CLOSED_VERTICES);
        Self::new("closed", capsule(length, radius, rings, around)?, CLOSED_HIDDEN, None)
    }

    fn new(name: &'static str, mesh: TriangleMesh, hidden: [f64; 2], synthesizer: Option<Synthesizer>) -> Result<Self> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in mesh.vertices() {
            (low, high) = (low.min(*p), high.max(*p));
        }
        Ok(Self {
            name,
            welding: Welding::of(&mesh)?,
            extent: (high - low).max_element(),
            mesh,
            hidden,
            synthesizer,
        })
    }

    /// Its completion, with the paper's weights.
    pub fn completion(&self) -> Result<ArapCompletion> {
        Ok(ArapCompletion::new(&self.mesh, CompletionOptions::default())?)
    }

    /// Frame `index`; `None` when it shows no vertex.
    pub fn frame(
        &self,
        camera: &Camera,
        seed: u64,
        index: u64,
        completion: &mut ArapCompletion,
    ) -> Result<Option<Completed>> {
        let view = match &self.synthesizer {
            Some(synthesizer) => PartialView::of_sheet(synthesizer, self.hidden, seed, index),
            None => PartialView::of_volumic(&self.mesh, camera, self.hidden, seed, index),
        };
        let points = VisibleVertices::new(&self.mesh, 0).find(&view.maps, camera)?;
        if points.is_empty() {
            return Ok(None);
        }
        let completed = completion.complete(&points, None)?;
        let (rest, truth) = (self.mesh.vertices(), &view.vertices_camera);
        // A vertex on a seam is visible when one of its copies is.
        let mut seen = vec![false; self.welding.mesh().vertices().len()];
        points
            .iter()
            .filter_map(|p| self.welding.welded(p.vertex))
            .for_each(|vertex| seen[vertex] = true);
        let welded_truth = self.welding.weld(truth);
        let error_of = |vertices: &[DVec3], of_seen: bool| {
            let vertices = self.welding.weld(vertices);
            rmse(
                (0..seen.len())
                    .filter(|&i| seen[i] == of_seen)
                    .map(|i| vertices[i].distance(welded_truth[i])),
            )
        };
        let (change, true_change) = (
            edge_length_change(&self.mesh, &completed.vertices),
            edge_length_change(&self.mesh, truth),
        );
        let report = FrameReport {
            index,
            hidden_fraction: seen.iter().filter(|seen| !**seen).count() as f64 / seen.len() as f64,
            arap_mm: error_of(&completed.vertices, false),
            rigid_mm: error_of(&rigid(rest, &points), false),
            laplacian_mm: error_of(&laplacian(&self.welding, rest, &points), false),
            visible_before_mm: rmse(points.iter().map(|p| p.p_camera.distance(truth[p.vertex]))),
            visible_after_mm: error_of(&completed.vertices, true),
            edge_change_median: change.median,
            edge_change_p95: change.p95,
            true_edge_change_p95: true_change.p95,
            flipped: flipped(self.welding.mesh(), &self.welding.weld(&completed.vertices)),
            true_flipped: flipped(self.welding.mesh(), &welded_truth),
            converged: completed.report.converged,
        };
        Ok(Some(Completed {
            report,
            view,
            points,
            vertices: completed.vertices,
        }))
    }
}

/// Root mean square of distances; 0 of none.
fn rmse(distances: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for distance in distances {
        sum += distance * distance;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// Pairs of neighbouring faces that lie folded on each other, normals more than 90 degrees apart.
fn flipped(mesh: &TriangleMesh, vertices: &[DVec3]) -> usize {
    let normals: Vec<DVec3> = mesh
        .faces()
        .iter()
        .map(|&[a, b, c]| (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]))
        .collect();
    let mut sides: Vec<([usize; 2], usize)> = Vec::new();
    for (face, &[a, b, c]) in mesh.faces().iter().enumerate() {
        sides.extend([[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], face)));
    }
    sides.sort_unstable();
    sides
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0 && normals[pair[0].1].dot(normals[pair[1].1]) < 0.0)
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_folded_over_its_neighbour_counts_as_flipped() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let uv = vec![Default::default(); 4];
        let mesh = TriangleMesh::new(corners.to_vec(), uv, vec![[0, 2, 1], [1, 2, 3]]).unwrap();
        assert_eq!(flipped(&mesh, mesh.vertices()), 0);
        let mut folded = corners.to_vec();
        folded[3] = DVec3::new(0.2, 0.2, 0.1);
        assert_eq!(flipped(&mesh, &folded), 1);
    }
}
