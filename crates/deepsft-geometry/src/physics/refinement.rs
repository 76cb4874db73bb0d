//! The refinement of one frame.

use super::locator::SurfaceLocator;
use super::measurements::{Measurement, measurements};
use crate::raster::VisibleSurface;
use crate::solver::normalized_image::GreyImage;
use crate::solver::{
    Bending, DepthPrior, Energy, ImagePoint, Isometry, LengthScale, MeshSolver, NormalizedImage, Photometric,
    PointDepth, Reprojection, Robust, SolveOptions, SolveReport, SurfacePoint, TexturePoint,
};
use crate::{Camera, GeometryError, Maps, Picture, RigidMotion, Template};
use glam::DVec3;

/// Fewest measurements from which a mesh is fitted.
const FEWEST_MEASUREMENTS: usize = 12;

/// Pixels between two photometric points.
const PHOTOMETRIC_STEP: usize = 3;

/// Window in which mean and contrast are taken, pixels.
const WINDOW_PX: f32 = 8.0;

/// Blur at which mesh and network are compared, pixels.
const JUDGED_BLUR_PX: f32 = 0.7;

/// Shares of the weight of isometry that a mesh far from its place is solved with in turn.
const STIFFENING: [f64; 3] = [0.01, 0.1, 1.0];

/// How the refinement weighs its terms. The defaults were chosen on synthetic validation frames.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicsOptions {
    /// Standard deviation of the network's registration, pixels: scale of the robust reprojection term.
    pub registration_deviation_px: f64,
    /// Standard deviation of the network's depth, as a share of the depth.
    pub depth_deviation: f64,
    /// How many independent measurements the depths of a frame are worth: their errors go together.
    pub independent_depths: f64,
    /// How many independent measurements the registrations of a frame are worth.
    pub independent_registrations: f64,
    /// Weight of isometry.
    pub isometry: f64,
    /// Weight of bending.
    pub bending: f64,
    /// How many independent measurements the photometric points of a frame are worth.
    pub photometric: f64,
    /// Scale of the robust photometric term, local deviations.
    pub photometric_scale: f64,
    /// Blur of image and drawing, pixels, one entry a round.
    pub blurs: Vec<f32>,
    /// Accepted solver steps a round.
    pub steps: usize,
}

impl Default for PhysicsOptions {
    fn default() -> Self {
        Self {
            registration_deviation_px: 2.0,
            depth_deviation: 0.03,
            independent_depths: 2.0,
            independent_registrations: 10.0,
            isometry: 1e4,
            bending: 1.0,
            photometric: 2000.0,
            photometric_scale: 0.8,
            blurs: vec![3.0, 2.0, 1.2, 0.7],
            steps: 8,
        }
    }
}

/// The outcome for one frame.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Depth and registration: of the mesh where it was accepted, the network's otherwise.
    pub maps: Maps,
    /// Vertices of the mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// Whether the mesh explains the image better than the network's maps do.
    pub accepted: bool,
    /// Mean robust photometric cost of the network's maps and of the mesh's, over the pixels of both.
    pub photometric_cost: [f64; 2],
    /// How each solve went: those without the image, then one a round.
    pub reports: Vec<SolveReport>,
}

/// Refines maps for one template.
pub struct PhysicsRefinement {
    template: Template,
    options: PhysicsOptions,
    locator: SurfaceLocator,
    /// Stiffer from one to the next, the last with the weight of the options.
    isometry: [Isometry; 3],
    bending: Bending,
    solver: MeshSolver,
    /// The print, grey, and its mipmap.
    print: Vec<GreyImage>,
}

impl PhysicsRefinement {
    /// Prepares everything that does not depend on the frame.
    ///
    /// # Errors
    /// [`GeometryError`] for weights that are no weights.
    pub fn new(template: &Template, options: PhysicsOptions) -> Result<Self, GeometryError> {
        let mesh = template.mesh();
        let scale = LengthScale::of(mesh)?;
        let stiffness = |share: f64| Isometry::new(mesh, scale, share * options.isometry);
        let [soft, medium, stiff] = STIFFENING;
        let isometry = [stiffness(soft)?, stiffness(medium)?, stiffness(stiff)?];
        let bending = Bending::new(mesh, options.bending)?;
        let solver = MeshSolver::new(mesh, &[&isometry[0], &bending])?;
        let mut level = template.texture().clone();
        let mut print = vec![GreyImage::of(&level)];
        while level.width() > 8 && level.height() > 8 {
            level = level.halved();
            print.push(GreyImage::of(&level));
        }
        Ok(Self {
            template: template.clone(),
            options,
            locator: SurfaceLocator::new(mesh),
            isometry,
            bending,
            solver,
            print,
        })
    }

    /// Refines `maps`, what a network says of `image`, taken by `camera`. `start`: the mesh of the last frame of a video,
    /// camera frame, mm. `None` when the maps show too little to fit a mesh to.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image, camera and maps are not of one size.
    pub fn refine(
        &mut self,
        image: &Picture,
        camera: &Camera,
        maps: &Maps,
        start: Option<&[DVec3]>,
    ) -> Result<Option<Refined>, GeometryError> {
        let expected = (camera.width() as usize, camera.height() as usize);
        for actual in [(image.width(), image.height()), (maps.width(), maps.height())] {
            if actual != expected {
                return Err(GeometryError::MapSize { actual, expected });
            }
        }
        let measured = measurements(maps, &self.template);
        if measured.len() < FEWEST_MEASUREMENTS {
            return Ok(None);
        }
        let (reprojection, depth) = self.measured_terms(&measured, camera)?;
        let mut vertices = match start {
            Some(start) => start.to_vec(),
            None => self.aligned(&measured, camera),
        };
        let mut reports = Vec::new();
        let options = SolveOptions {
            max_iterations: 12,
            step_tolerance: 1e-3,
            energy_tolerance: 1e-4,
            judge_rank: false,
        };
        // A stiff sheet far from its place moves in tiny steps: let it stretch at first.
        let softest = if start.is_some() { self.isometry.len() - 1 } else { 0 };
        for isometry in &self.isometry[softest..] {
            let terms: [&dyn Energy; 4] = [&reprojection, &depth, isometry, &self.bending];
            let solution = self.solver.solve(&terms, &vertices, &options)?;
            vertices = solution.vertices;
            reports.push(solution.report);
        }

        let seen: Vec<f32> = (0..maps.depth().len())
            .map(|p| f32::from(u8::from(maps.inside(p))))
            .collect();
        let grey = GreyImage::of(image);
        let stiff = &self.isometry[self.isometry.len() - 1];
        for &blur in &self.options.blurs {
            let drawing = Drawing::new(self, &vertices, camera, &seen);
            let points = drawing.points(blur);
            let image = NormalizedImage::masked(&grey, &drawing.mask, blur, WINDOW_PX);
            let photometric = Photometric::new(
                self.template.mesh(),
                camera,
                &image,
                &points,
                self.options.photometric / points.len().max(1) as f64,
                Robust::Cauchy(self.options.photometric_scale),
            )?;
            let options = SolveOptions {
                max_iterations: self.options.steps,
                step_tolerance: 1e-3,
                energy_tolerance: 1e-4,
                judge_rank: false,
            };
            let terms: [&dyn Energy; 5] = [&photometric, &reprojection, &depth, stiff, &self.bending];
            let solution = self.solver.solve(&terms, &vertices, &options)?;
            vertices = solution.vertices;
            reports.push(solution.report);
        }
        Ok(Some(self.judge(&grey, camera, maps, vertices, reports)))
    }

    /// The terms that the network's maps give.
    fn measured_terms(
        &self,
        measured: &[Measurement],
        camera: &Camera,
    ) -> Result<(Reprojection, DepthPrior), GeometryError> {
        let mesh = self.template.mesh();
        let located: Vec<(SurfacePoint, &Measurement)> = measured
            .iter()
            .filter_map(|m| Some((self.locator.locate(m.uv)?, m)))
            .collect();
        let count = located.len().max(1) as f64;
        let deviation = self.options.registration_deviation_px;
        let weight = self.options.independent_registrations / count / (deviation * deviation);
        let points: Vec<ImagePoint> = located
            .iter()
            .map(|&(point, m)| ImagePoint {
                point,
                pixel: m.pixel,
                weight,
            })
            .collect();
        let depths: Vec<PointDepth> = located
            .iter()
            .map(|&(point, m)| PointDepth {
                point,
                depth: m.depth_mm,
                deviation: self.options.depth_deviation * m.depth_mm,
            })
            .collect();
        Ok((
            Reprojection::new(mesh, camera, &points, Robust::Cauchy(1.5 * deviation))?,
            DepthPrior::new(
                mesh,
                &depths,
                self.options.independent_depths / count,
                Robust::Cauchy(2.0),
            )?,
        ))
    }

    /// The flat sheet where the measurements are.
    fn aligned(&self, measured: &[Measurement], camera: &Camera) -> Vec<DVec3> {
        let pairs = measured.iter().map(|m| {
            (
                self.template.point_template(m.uv),
                camera.unproject(m.pixel, m.depth_mm),
                1.0,
            )
        });
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        self.template
            .mesh()
            .vertices()
            .iter()
            .map(|&p| motion.apply(p))
            .collect()
    }

    /// Chooses between mesh and maps.
    fn judge(
        &self,
        grey: &GreyImage,
        camera: &Camera,
        maps: &Maps,
        vertices: Vec<DVec3>,
        reports: Vec<SolveReport>,
    ) -> Refined {
        let surface = VisibleSurface::new(self.template.mesh(), &vertices, camera);
        let mut refined = surface.maps();
        let both: Vec<f32> = (0..maps.depth().len())
            .map(|p| f32::from(u8::from(maps.inside(p) && refined.inside(p))))
            .collect();
        let image = NormalizedImage::masked(grey, &both, JUDGED_BLUR_PX, WINDOW_PX);
        let cost = |maps: &Maps| {
            let drawn = NormalizedImage::masked(&self.drawn(maps, &both, camera), &both, JUDGED_BLUR_PX, WINDOW_PX);
            let robust = Robust::Cauchy(self.options.photometric_scale);
            let (mut sum, mut count) = (0.0, 0_usize);
            for pixel in (0..both.len()).filter(|&p| both[p] > 0.0) {
                sum += robust.rho((image.pixel(pixel) - drawn.pixel(pixel)).powi(2));
                count += 1;
            }
            sum / count.max(1) as f64
        };
        let photometric_cost = [cost(maps), cost(&refined)];
        let accepted = photometric_cost[1] < photometric_cost[0];
        if accepted {
            // The mask is the network's: it sees what lies in front. Where the mesh ends before it, its own values stay.
            refined = refined.within(maps);
        } else {
            refined = maps.clone();
        }
        Refined {
            maps: refined,
            vertices_camera: vertices,
            accepted,
            photometric_cost,
            reports,
        }
    }

    /// The print as `maps` place it in the image of `camera`, where `mask` is 1.
    fn drawn(&self, maps: &Maps, mask: &[f32], camera: &Camera) -> GreyImage {
        let size = self.template.size_mm();
        // Texels a pixel, by the focal length of the typical depth: mm a pixel times texels a mm.
        let texels = self.print[0].width as f64 / size.x;
        let mut depths: Vec<f32> = (0..mask.len())
            .filter(|&p| mask[p] > 0.0)
            .map(|p| maps.depth()[p])
            .collect();
        depths.sort_unstable_by(f32::total_cmp);
        let depth = depths.get(depths.len() / 2).copied().unwrap_or(500.0);
        let level = self.level(texels * f64::from(depth) / camera.focal().x);
        let values = (0..mask.len())
            .map(|p| {
                if mask[p] > 0.0 {
                    let [u, v] = maps.registration()[p];
                    sample(level, f64::from(u), f64::from(v))
                } else {
                    0.0
                }
            })
            .collect();
        GreyImage {
            width: maps.width(),
            height: maps.height(),
            values,
        }
    }

    /// The level of the mipmap with at most about one texel a pixel.
    fn level(&self, texels_a_pixel: f64) -> &GreyImage {
        let level = texels_a_pixel.max(1.0).log2().round() as usize;
        &self.print[level.min(self.print.len() - 1)]
    }
}

/// Bilinear value of a grey image at texture position (u, v).
fn sample(image: &GreyImage, u: f64, v: f64) -> f32 {
    let x = (u * image.width as f64 - 0.5).clamp(0.0, (image.width - 1) as f64);
    let y = (v * image.height as f64 - 0.5).clamp(0.0, (image.height - 1) as f64);
    let (column, row) = (x as usize, y as usize);
    let (a, b) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let right = (column + 1).min(image.width - 1);
    let below = (row + 1).min(image.height - 1) * image.width;
    let row = row * image.width;
    let value = |i: usize| image.values[i];
    let top = value(row + column) * (1.0 - a) + value(row + right) * a;
    let bottom = value(below + column) * (1.0 - a) + value(below + right) * a;
    top * (1.0 - b) + bottom * b
}

/// The mesh drawn with its print.
struct Drawing {
    print: GreyImage,
    /// 1 where the mesh and the object are seen.
    mask: Vec<f32>,
    /// Pixel, face and weights of the photometric points.
    anchors: Vec<(usize, SurfacePoint)>,
}

impl Drawing {
    fn new(refinement: &PhysicsRefinement, vertices: &[DVec3], camera: &Camera, seen: &[f32]) -> Self {
        let surface = VisibleSurface::new(refinement.template.mesh(), vertices, camera);
        let (width, height) = (camera.width() as usize, camera.height() as usize);
        let mut mask = vec![0.0; width * height];
        let mut anchors = Vec::new();
        for (column, row, face, triangle) in surface.front() {
            let pixel = row * width + column;
            if seen[pixel] > 0.0 {
                mask[pixel] = 1.0;
                if column % PHOTOMETRIC_STEP == 1 && row % PHOTOMETRIC_STEP == 1 {
                    let barycentric = triangle.barycentric(column as f64 + 0.5, row as f64 + 0.5);
                    anchors.push((pixel, SurfacePoint { face, barycentric }));
                }
            }
        }
        let print = refinement.drawn(&surface.maps(), &mask, camera);
        Self { print, mask, anchors }
    }

    /// The photometric points with what the print shows there, blurred by `blur` pixels.
    fn points(&self, blur: f32) -> Vec<TexturePoint> {
        let print = NormalizedImage::masked(&self.print, &self.mask, blur, WINDOW_PX);
        self.anchors
            .iter()
            .map(|&(pixel, point)| TexturePoint {
                point,
                value: print.pixel(pixel),
            })
            .collect()
    }
}
