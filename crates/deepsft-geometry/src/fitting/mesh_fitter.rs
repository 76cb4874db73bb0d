//! One template's mesh against images: the part that the fit of one frame and tracking have in common.

use super::border::Border;
use super::correlation::{Correlation, POINT_STEP};
use super::grid_interpolation::GridInterpolation;
use super::isometric_mesh::{IsometricMesh, Stiffness};
use super::measurements::Observation;
use super::print::{Drawing, Print};
use super::rigid_fit::rigid_fit;
use crate::error::Result;
use crate::image::{ContrastNormalizer, Region};
use crate::maps::raster::VisibleSurface;
use crate::mesh::{RigidMotion, Template, TriangleMesh};
use crate::solver::{Energy, PhotoConsistency, Robust, TexturePoint};
use crate::surface::Surface;
use glam::DVec3;

/// Least width of the window in which mean and contrast are taken, pixels of the canonical image.
pub(crate) const WINDOW_PX: f32 = 8.0;

/// The same as a multiple of the blur: a window hardly wider than the blur would leave nothing to compare.
const WINDOW_BLURS: f32 = 3.0;

/// How much higher the correlation of a solid must be where it may bend, or it keeps its rest shape. In close-ups of 21 frames of a box and
/// a tube at rest it was at most 0.011 higher (a rigidity of 100), of 21 in which they are bent 0.003, 0.011 and from 0.023 on.
const BENT: f64 = 0.012;

/// Steps of a rigid motion before the mesh of a solid bends: if it is stiff, it turns slowly by itself.
pub(crate) const RIGID_STEPS: usize = 10;

/// Weight of rigidity, of a template that is no sheet.
pub(crate) const RIGIDITY: f64 = 30.0;

/// How many independent measurements the photo-consistency points of a frame are worth, and how large deviations, of local ones, count.
const PHOTO_CONSISTENCY: f64 = 2000.0;
const ROBUST: Robust = Robust::Cauchy(0.8);

/// Accepted solver steps of a round.
pub(crate) const STEPS: usize = 8;

/// How much larger the cells of the coarse mesh are.
const COARSE_CELLS: usize = 2;

/// A template with everything about it that does not depend on the frame.
#[derive(Debug)]
pub(crate) struct MeshFitter {
    pub(crate) template: Template,
    pub(crate) print: Print,
    /// The template's own mesh.
    pub(crate) fine: IsometricMesh,
    /// Of a sheet one with fewer vertices, several times quicker to solve.
    coarser: Option<CoarserMesh>,
}

#[derive(Debug)]
struct CoarserMesh {
    mesh: IsometricMesh,
    to_fine: GridInterpolation,
    to_fine_linear: GridInterpolation,
    to_coarse: GridInterpolation,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Resolution {
    Fine,
    Coarse,
}

/// One photo-consistency solve.
#[derive(Clone, Copy)]
pub(crate) struct FitRound<'a> {
    pub(crate) resolution: Resolution,
    /// Blur of image and drawing, pixels of the observed image.
    pub(crate) blur: f32,
    /// Width of the window in which mean and contrast are taken, pixels of the observed image.
    pub(crate) window: f32,
    /// Pixels of the observed image beside the silhouette and beside what hides the object that are not compared.
    pub(crate) margin: usize,
    /// Steps of a rigid motion before the mesh may bend.
    pub(crate) rigid_steps: usize,
    /// Accepted solver steps.
    pub(crate) steps: usize,
    /// Whether the mesh is near its place.
    pub(crate) is_near: bool,
    /// Confidence of each vertex, and the confidence above which a point holds the mesh; without it all do.
    pub(crate) trusted: Option<(&'a [f32], f64)>,
    /// Whether the mesh is held to the paper's border, where that is seen.
    pub(crate) border: bool,
    pub(crate) stiffness: Stiffness,
    /// Pixels of the observed image along the side of a pixel of the canonical image. What is seen counts for its square: errors in
    /// mm are that much smaller.
    pub(crate) detail: f64,
    /// Pixels of the observed image between two points that are compared.
    pub(crate) point_step: usize,
}

impl FitRound<'_> {
    /// Takes `steps` steps of the coarse mesh at this blur.
    pub(crate) fn new(blur: f32, steps: usize) -> Self {
        Self {
            resolution: Resolution::Coarse,
            blur,
            window: WINDOW_PX.max(WINDOW_BLURS * blur),
            margin: 0,
            rigid_steps: 0,
            steps,
            is_near: false,
            trusted: None,
            border: false,
            stiffness: Stiffness::WHOLE,
            detail: 1.0,
            point_step: POINT_STEP,
        }
    }

    /// The same round on the image at half the size.
    pub(crate) fn halved(self) -> Self {
        Self {
            blur: self.blur / 2.0,
            window: self.window / 2.0,
            margin: self.margin / 2,
            ..self
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) correlation: Correlation,
    pub(crate) iterations: usize,
    pub(crate) energy: f64,
    /// Whether it was moved as it is at rest.
    pub(crate) is_rigid: bool,
}

impl Fitted {
    pub(crate) fn unmoved(vertices: Vec<DVec3>) -> Self {
        Self {
            vertices,
            correlation: Correlation::default(),
            iterations: 0,
            energy: f64::INFINITY,
            is_rigid: false,
        }
    }

    /// Makes `surface` this mesh, with what the image says of it; `ambiguity` as in [`Verdict`](crate::Verdict).
    pub(crate) fn replace(self, surface: &mut Surface, ambiguity: Option<f64>) {
        surface.vertices_camera = self.vertices;
        surface.verdict = self.correlation.verdict(ambiguity);
        surface.confidence = self.correlation.confidence;
        if !surface.is_hidden.is_empty() {
            surface.is_hidden = self.correlation.is_hidden;
        }
    }

    /// Mean distance of its vertices from `vertices`, mm.
    pub(crate) fn distance(&self, vertices: &[DVec3]) -> f64 {
        let ways = self.vertices.iter().zip(vertices).map(|(a, b)| a.distance(*b));
        ways.sum::<f64>() / vertices.len() as f64
    }

    /// Whether the image confirms more of it than of `other`.
    pub(crate) fn confirms_more_than(&self, other: &Self) -> bool {
        let (own, other) = (&self.correlation, &other.correlation);
        own.confirmed_evidence() > other.confirmed_evidence() && own.whole > other.whole
    }

    /// This rigid mesh, or `bent` where the image tells that the solid is bent, with the steps of both.
    pub(crate) fn unless_bent(self, bent: Self) -> Self {
        let iterations = self.iterations + bent.iterations;
        let is_bent = bent.correlation.whole >= self.correlation.whole + BENT;
        let taken = if is_bent { bent } else { Self { is_rigid: true, ..self } };
        Self { iterations, ..taken }
    }

    /// This or `other`, whichever the image confirms more, with the steps of both.
    pub(crate) fn or_better(self, other: Self) -> Self {
        let iterations = self.iterations + other.iterations;
        let better = if other.confirms_more_than(&self) { other } else { self };
        Self { iterations, ..better }
    }
}

impl MeshFitter {
    /// Prepares everything that does not depend on the frame. `rigidity` is the weight of rigidity, of a template that is no sheet.
    pub(crate) fn new(template: &Template, rigidity: f64) -> Result<Self> {
        let mesh = template.mesh();
        let isometric = |own: &TriangleMesh| IsometricMesh::new(own.clone(), mesh);
        let (fine, coarser) = if template.is_sheet() {
            let coarse = template.coarser(COARSE_CELLS)?;
            let coarser = CoarserMesh {
                mesh: isometric(coarse.mesh())?,
                to_fine: GridInterpolation::cubic(&coarse, mesh)?,
                to_fine_linear: GridInterpolation::linear(&coarse, mesh)?,
                to_coarse: GridInterpolation::cubic(template, coarse.mesh())?,
            };
            (isometric(mesh)?, Some(coarser))
        } else {
            (IsometricMesh::solid(mesh.clone(), rigidity)?, None)
        };
        Ok(Self {
            print: Print::of(template),
            fine,
            coarser,
            template: template.clone(),
        })
    }

    /// The mesh at rest, where `vertices` are that the image confirms, or all where it confirms none.
    pub(crate) fn rigid(&self, vertices: &[DVec3], confidence: &[f32]) -> Vec<DVec3> {
        let rest = self.template.mesh().vertices();
        let pairs = rest.iter().zip(vertices).zip(confidence);
        let pairs = pairs.map(|((&p, &q), &confidence)| (p, q, f64::from(confidence) + 1e-3));
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        rest.iter().map(|&p| motion.apply(p)).collect()
    }

    /// The mesh that is quickest to solve: of a template that is no sheet the only one.
    pub(crate) fn coarse(&self) -> &IsometricMesh {
        self.coarser.as_ref().map_or(&self.fine, |coarser| &coarser.mesh)
    }

    pub(crate) fn coarse_mut(&mut self) -> &mut IsometricMesh {
        self.coarser
            .as_mut()
            .map_or(&mut self.fine, |coarser| &mut coarser.mesh)
    }

    /// The coarse mesh's vertices as the fine mesh's: smooth between them.
    pub(crate) fn fine_vertices(&self, coarse: &[DVec3]) -> Vec<DVec3> {
        let to_fine = |coarser: &CoarserMesh| coarser.to_fine.apply(coarse);
        self.coarser.as_ref().map_or_else(|| coarse.to_vec(), to_fine)
    }

    pub(crate) fn coarse_vertices(&self, fine: &[DVec3]) -> Vec<DVec3> {
        let to_coarse = |coarser: &CoarserMesh| coarser.to_coarse.apply(fine);
        self.coarser.as_ref().map_or_else(|| fine.to_vec(), to_coarse)
    }

    pub(crate) fn coarse_scalars(&self, fine: &[f32]) -> Vec<f32> {
        let to_coarse = |coarser: &CoarserMesh| coarser.to_coarse.apply_scalars(fine);
        self.coarser.as_ref().map_or_else(|| fine.to_vec(), to_coarse)
    }

    pub(crate) fn fine_scalars(&self, coarse: &[f32]) -> Vec<f32> {
        let to_fine = |coarser: &CoarserMesh| coarser.to_fine_linear.apply_scalars(coarse);
        self.coarser.as_ref().map_or_else(|| coarse.to_vec(), to_fine)
    }

    pub(crate) fn fine_confidence(&self, coarse: &[f32]) -> Vec<f32> {
        let fine = self.fine_scalars(coarse).into_iter();
        // Rounding may have left the range.
        fine.map(|confidence| confidence.clamp(0.0, 1.0)).collect()
    }

    /// Draws the mesh at `start`, compares it with the image and moves it until they agree. Also says how they agree in the end, at
    /// all points.
    pub(crate) fn round(
        &mut self,
        observation: Observation<'_>,
        start: &[DVec3],
        round: &FitRound<'_>,
        priors: &[&dyn Energy],
    ) -> Result<Fitted> {
        let (fitted, ()) = self.round_and(observation, start, round, priors, |_, _, _| ())?;
        Ok(fitted)
    }

    /// As [`MeshFitter::round`], and what `then` makes of the terms that held the mesh to the image, where the mesh ended.
    pub(crate) fn round_and<T>(
        &mut self,
        Observation { grey, camera, mask }: Observation<'_>,
        start: &[DVec3],
        round: &FitRound<'_>,
        priors: &[&dyn Energy],
        then: impl FnOnce(&mut IsometricMesh, (&PhotoConsistency<'_>, &[&dyn Energy]), &[DVec3]) -> T,
    ) -> Result<(Fitted, T)> {
        let print = &self.print;
        let isometric = match (round.resolution, &mut self.coarser) {
            (Resolution::Coarse, Some(coarser)) => &mut coarser.mesh,
            _ => &mut self.fine,
        };
        let surface = VisibleSurface::new(&isometric.mesh, start, camera);
        let shown = Region::shown(grey);
        let border = ContrastNormalizer::reach(round.blur);
        let mut drawing = Drawing::new(
            print,
            &surface,
            (&shown, mask),
            (border, round.margin),
            Some(round.point_step),
        );
        let mask = std::mem::take(&mut drawing.mask);
        let normalizer = ContrastNormalizer::new(mask, drawing.region, camera.size(), round.blur, round.window);
        let image = normalizer.normalize(drawing.region.of(grey)).shown_in(shown);
        let points = drawing.points(&normalizer.normalize(drawing.print.iter().copied()));
        let faces = isometric.mesh.faces();
        let holds = |p: &&TexturePoint| {
            let is_above = |(confidence, least)| p.point.interpolated(faces, confidence) > least;
            round.trusted.is_none_or(is_above)
        };
        let holding: Vec<_> = points.iter().filter(holds).copied().collect();
        let mut vertices = start.to_vec();
        if round.rigid_steps > 0 {
            let position = |p: &TexturePoint| (p.point.position(faces, start), p.value);
            let positions: Vec<_> = holding.iter().map(position).collect();
            let motion = rigid_fit(&image, camera, &positions, ROBUST, round.rigid_steps);
            vertices = vertices.into_iter().map(motion).collect();
        }
        let weight = PHOTO_CONSISTENCY * round.detail.powi(2) / holding.len().max(1) as f64;
        let photo_consistency = PhotoConsistency::new(isometric.welded(), camera, &image, &holding, weight, ROBUST)?;
        let mut terms: Vec<&dyn Energy> = vec![&photo_consistency];
        let look = || Border::new(&isometric.border, start, &surface, print, (grey, &shown), round.detail);
        let border = round.border.then(look);
        terms.extend(border.iter().map(|border| border as &dyn Energy));
        let of_image = terms.clone();
        terms.extend(priors);
        let (mut iterations, mut energy) = (0, f64::INFINITY);
        // A cage would round the vertices of a solid.
        if round.steps > 0 || self.template.is_sheet() {
            let solution = isometric.solve(round.stiffness, &terms, &vertices, round.steps, round.is_near)?;
            (iterations, energy) = (solution.iterations, solution.final_energy);
            vertices = solution.vertices;
        }
        let correlation = Correlation {
            detail: round.detail,
            point_px: (round.point_step as f64 / round.detail).powi(2),
            ..Correlation::of(&isometric.mesh, camera, &image, &points, &vertices)
        };
        let then = then(isometric, (&photo_consistency, &of_image), &vertices);
        let fitted = Fitted {
            vertices,
            correlation,
            iterations,
            energy,
            is_rigid: false,
        };
        Ok((fitted, then))
    }
}
