//! How well the image confirms a mesh, as a whole and around each vertex.

use crate::camera::Camera;
use crate::image::ContrastNormalizedImage;
use crate::mesh::TriangleMesh;
use crate::solver::TexturePoint;
use crate::verdict::Verdict;
use glam::{DVec3, DVec4};

/// Pixels of the observed image between two photo-consistency points.
pub(crate) const POINT_STEP: usize = 3;

/// Square of the normalised contrast that counts as none (a fifth of a local deviation): around a vertex with less
/// on average, be it in the print or in the image, nothing is confirmed.
const NO_CONTRAST: f64 = 0.04;

/// Correlation around a vertex from which the image confirms the print there, and below which it shows something else.
const CONFIRMED: f64 = 0.5;
const CONTRADICTED: f64 = 0.25;

/// Correlation between image and print, both locally normalised.
#[derive(Clone, Debug, Default)]
pub(crate) struct Correlation {
    /// Of the whole visible print: 1 when the image shows it exactly, about 0 when it shows something else.
    pub(crate) whole: f64,
    /// The same around each vertex, 0 to 1; 0 where nothing is seen or nothing is printed.
    pub(crate) confidence: Vec<f32>,
    /// Points at which image and print were compared.
    pub(crate) points: usize,
    /// Of the visible vertices around which the print has contrast: the fraction that the image confirms.
    pub(crate) explained: f64,
    /// Points around those that it confirms.
    pub(crate) confirmed_points: f64,
    /// Whether something hides each vertex: the print has contrast there and the image shows something else.
    pub(crate) is_hidden: Vec<bool>,
    /// As [`Verdict::detail`].
    pub(crate) detail: f64,
    /// Pixels of the canonical image that a point stands for.
    pub(crate) point_px: f64,
}

/// Weighted sums over points: squares of the image, squares of the print, their products, weights.
#[derive(Clone, Copy, Default)]
struct CorrelationSums(DVec4);

impl CorrelationSums {
    fn add(&mut self, seen: f64, printed: f64, weight: f64) {
        let (image, print, both) = (
            weight * seen * seen,
            weight * printed * printed,
            weight * seen * printed,
        );
        self.0 += DVec4::new(image, print, both, weight);
    }

    fn weight(&self) -> f64 {
        self.0.w
    }

    /// Whether there is contrast in the print.
    fn tells(&self) -> bool {
        self.0.y > NO_CONTRAST * self.weight() && self.weight() > 0.0
    }

    /// Correlation, 0 when negative; no contrast counts against it.
    fn correlation(&self) -> f64 {
        let [image, print, both, weight] = self.0.to_array();
        let floor = NO_CONTRAST * weight;
        let norm = (image + floor).sqrt() * (print + floor).sqrt();
        if norm > 0.0 { (both / norm).clamp(0.0, 1.0) } else { 0.0 }
    }
}

impl Correlation {
    /// What the image says of the mesh; `ambiguity` as in [`Verdict`].
    pub(crate) fn verdict(&self, ambiguity: Option<f64>) -> Verdict {
        Verdict {
            correlation: self.whole,
            explained: self.explained,
            confirmed_px: self.confirmed_points * self.point_px,
            detail: self.detail,
            ambiguity,
        }
    }

    /// Correlation times the points compared: what the whole image says for the mesh.
    pub(crate) fn confirmed_evidence(&self) -> f64 {
        self.whole * self.points as f64
    }

    /// Correlation times the root of the points compared: how far it is from chance. A mesh that hides what the image contradicts
    /// has a higher correlation, of fewer points.
    pub(crate) fn significance(&self) -> f64 {
        self.whole * (self.points as f64).sqrt()
    }

    /// Compares what the print shows at `points` with the image where the mesh at `vertices` (camera frame) puts them.
    pub(crate) fn of(
        mesh: &TriangleMesh,
        camera: &Camera,
        image: &ContrastNormalizedImage,
        points: &[TexturePoint],
        vertices: &[DVec3],
    ) -> Self {
        let mut whole = CorrelationSums::default();
        let mut around = vec![CorrelationSums::default(); vertices.len()];
        let mut compared = 0;
        for point in points {
            let corners = mesh.faces()[point.point.face];
            let weights = point.point.barycentric;
            let position = point.point.position(mesh.faces(), vertices);
            let Some((seen, _)) = camera.project(position).and_then(|pixel| image.sample(pixel)) else {
                continue;
            };
            compared += 1;
            whole.add(seen, point.value, 1.0);
            for (vertex, weight) in corners.into_iter().zip(weights) {
                around[vertex].add(seen, point.value, weight.max(0.0));
            }
        }
        // A vertex has a handful of points to itself: take its neighbours' too.
        let mut wide = around.clone();
        for [a, b] in mesh.edges() {
            wide[a].0 += around[b].0;
            wide[b].0 += around[a].0;
        }
        let mut judged = Self {
            whole: whole.correlation(),
            points: compared,
            confidence: Vec::with_capacity(around.len()),
            is_hidden: Vec::with_capacity(around.len()),
            ..Self::default()
        };
        let mut telling = 0.0;
        for (own, wide) in around.iter().zip(&wide) {
            let (is_seen, correlation) = (own.weight() > 0.0, wide.correlation());
            let tells = is_seen && wide.tells();
            judged.confidence.push(if is_seen { correlation as f32 } else { 0.0 });
            judged.is_hidden.push(tells && correlation < CONTRADICTED);
            if tells {
                telling += own.weight();
            }
            if tells && correlation >= CONFIRMED {
                judged.confirmed_points += own.weight();
            }
        }
        if telling > 0.0 {
            judged.explained = judged.confirmed_points / telling;
        }
        judged
    }
}
