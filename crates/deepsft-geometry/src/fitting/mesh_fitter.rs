//! One template's mesh against images: the part that the fit of one frame and tracking have in common.

use super::correlation::{Correlation, POINT_STEP};
use super::grid_interpolation::GridInterpolation;
use super::isometric_mesh::IsometricMesh;
use super::options::FitOptions;
use super::print::{Drawing, Print};
use super::rigid_fit::rigid_fit;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::{ContrastNormalizedImage, ContrastNormalizer, GreyImage};
use crate::maps::raster::VisibleSurface;
use crate::mesh::{SurfacePoint, Template, TriangleMesh};
use crate::solver::{Energy, PhotoConsistency, Robust, SolveReport, TexturePoint};
use glam::DVec3;

/// Least width of the window in which mean and contrast are taken, pixels.
pub(crate) const WINDOW_PX: f32 = 8.0;

/// The same as a multiple of the blur: a window hardly wider than the blur would leave nothing to compare.
const WINDOW_BLURS: f32 = 3.0;

/// How much larger the cells of the coarse mesh are.
const COARSE_CELLS: usize = 2;

/// A template with everything about it that does not depend on the frame.
pub(crate) struct MeshFitter {
    pub(crate) template: Template,
    pub(crate) print: Print,
    /// The template's own mesh.
    pub(crate) fine: IsometricMesh,
    /// One with fewer vertices, several times quicker to solve.
    pub(crate) coarse: IsometricMesh,
    to_fine: GridInterpolation,
    to_fine_linear: GridInterpolation,
    to_coarse: GridInterpolation,
    photo_consistency: f64,
    robust: Robust,
}

/// Which mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Resolution {
    Fine,
    Coarse,
}

/// One photo-consistency solve.
pub(crate) struct FitRound {
    /// Which mesh moves.
    pub(crate) resolution: Resolution,
    /// Blur of image and drawing, pixels.
    pub(crate) blur: f32,
    /// Width of the window in which mean and contrast are taken, pixels.
    pub(crate) window: f32,
    /// Pixels beside the silhouette and beside what hides the object that are not compared.
    pub(crate) margin: usize,
    /// Steps of a rigid motion before the mesh may bend.
    pub(crate) rigid_steps: usize,
    /// Accepted solver steps.
    pub(crate) steps: usize,
    /// Whether the mesh is near its place.
    pub(crate) is_near: bool,
}

/// The outcome of a [`FitRound`].
pub(crate) struct FittedRound {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) report: SolveReport,
    pub(crate) correlation: Correlation,
}

/// The window that goes with a blur, pixels.
pub(crate) fn window_of(blur: f32) -> f32 {
    WINDOW_PX.max(WINDOW_BLURS * blur)
}

/// Refuses a list of rounds that is empty or has a blur that is none.
pub(crate) fn check_blurs(blurs: &[f32]) -> Result<(), GeometryError> {
    let wrong = |blur: &&f32| !(blur.is_finite() && **blur >= 0.0);
    let actual = match blurs.iter().find(wrong) {
        Some(&blur) => blur,
        None if blurs.is_empty() => f32::NAN,
        None => return Ok(()),
    };
    Err(GeometryError::Weight {
        term: "blur",
        actual: f64::from(actual),
    })
}

impl MeshFitter {
    /// Prepares for a sheet; [`GeometryError::NotASheet`] for a template of another shape.
    pub(crate) fn new(template: &Template, options: &FitOptions) -> Result<Self, GeometryError> {
        template.grid().ok_or(GeometryError::NotASheet {
            operation: "fitting or tracking a mesh",
        })?;
        let fine = template.mesh();
        let coarse = template.coarser(COARSE_CELLS)?;
        let isometric = |mesh: &TriangleMesh| IsometricMesh::new(mesh.clone(), fine, options.isometry, options.bending);
        Ok(Self {
            print: Print::of(template),
            fine: isometric(fine)?,
            coarse: isometric(coarse.mesh())?,
            to_fine: GridInterpolation::cubic(&coarse, fine)?,
            to_fine_linear: GridInterpolation::linear(&coarse, fine)?,
            to_coarse: GridInterpolation::cubic(template, coarse.mesh())?,
            template: template.clone(),
            photo_consistency: options.photo_consistency,
            robust: Robust::Cauchy(options.photo_consistency_scale),
        })
    }

    /// The coarse mesh's vertices as the fine mesh's: smooth between them.
    pub(crate) fn fine_vertices(&self, coarse: &[DVec3]) -> Vec<DVec3> {
        self.to_fine.apply(coarse)
    }

    /// The fine mesh's vertices as the coarse mesh's.
    pub(crate) fn coarse_vertices(&self, fine: &[DVec3]) -> Vec<DVec3> {
        self.to_coarse.apply(fine)
    }

    /// Confidences of the coarse mesh's vertices as the fine mesh's.
    pub(crate) fn fine_confidence(&self, coarse: &[f32]) -> Vec<f32> {
        self.to_fine_linear.apply_fractions(coarse)
    }

    /// Draws the mesh at `start`, compares it with the image in the pixels (column, row) that `seen` allows and at the points that
    /// `trusted` allows, and moves it until they agree. Also says how they agree in the end, at all points.
    pub(crate) fn round(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        start: &[DVec3],
        round: &FitRound,
        seen: impl Fn(usize, usize) -> bool,
        trusted: impl Fn(&SurfacePoint) -> bool,
        priors: &[&dyn Energy],
    ) -> Result<FittedRound, GeometryError> {
        let fitted = self.round_and((grey, camera), start, round, seen, trusted, priors, |_, _, _| ())?;
        Ok(fitted.0)
    }

    /// As [`MeshFitter::round`], and what `then` makes of the term that held the mesh to the image, where the mesh ended.
    #[expect(clippy::too_many_arguments, reason = "those of a round")]
    pub(crate) fn round_and<T>(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        start: &[DVec3],
        round: &FitRound,
        seen: impl Fn(usize, usize) -> bool,
        trusted: impl Fn(&SurfacePoint) -> bool,
        priors: &[&dyn Energy],
        then: impl FnOnce(&mut IsometricMesh, &PhotoConsistency<'_>, &[DVec3]) -> T,
    ) -> Result<(FittedRound, T), GeometryError> {
        let (print, robust) = (&self.print, self.robust);
        let isometric = match round.resolution {
            Resolution::Fine => &mut self.fine,
            Resolution::Coarse => &mut self.coarse,
        };
        let surface = VisibleSurface::new(&isometric.mesh, start, camera);
        let border = ContrastNormalizer::reach(round.blur);
        let mut drawing = Drawing::new(print, &surface, seen, (border, round.margin), Some(POINT_STEP));
        let mask = std::mem::take(&mut drawing.mask);
        let normalizer = ContrastNormalizer::new(mask, drawing.part, camera.size(), round.blur, round.window);
        let image = normalizer.normalize(drawing.part.of(&grey.values, grey.width));
        let points = drawing.points(&normalizer.normalize(drawing.print.iter().copied()));
        let fitted: Vec<_> = points.iter().filter(|p| trusted(&p.point)).copied().collect();
        let mut vertices = start.to_vec();
        if round.rigid_steps > 0 {
            vertices = rigidly_moved(
                isometric,
                (&image, camera),
                &fitted,
                vertices,
                robust,
                round.rigid_steps,
            );
        }
        let weight = self.photo_consistency / fitted.len().max(1) as f64;
        let photo_consistency = PhotoConsistency::new(&isometric.mesh, camera, &image, &fitted, weight, robust)?;
        let mut terms: Vec<&dyn Energy> = vec![&photo_consistency];
        terms.extend(priors);
        isometric.halving = round.is_near;
        let solved = isometric.solve(&terms, &vertices, round.steps);
        isometric.halving = false;
        let (vertices, report) = solved?;
        let correlation = Correlation::of(&isometric.mesh, camera, &image, &points, &vertices);
        let then = then(isometric, &photo_consistency, &vertices);
        let fitted = FittedRound {
            vertices,
            report,
            correlation,
        };
        Ok((fitted, then))
    }
}

fn rigidly_moved(
    isometric: &IsometricMesh,
    (image, camera): (&ContrastNormalizedImage, &Camera),
    points: &[TexturePoint],
    vertices: Vec<DVec3>,
    robust: Robust,
    steps: usize,
) -> Vec<DVec3> {
    let faces = isometric.mesh.faces();
    let position = |p: &TexturePoint| (p.point.position(faces, &vertices), p.value);
    let positions: Vec<_> = points.iter().map(position).collect();
    let place = rigid_fit(image, camera, &positions, robust, steps);
    vertices.into_iter().map(place).collect()
}
