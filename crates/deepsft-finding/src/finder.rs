//! The feature finder: one printed picture, or the print of one solid, in images.

use crate::consensus::{SMALLEST_GROUP, groups};
use crate::descriptor::Descriptor;
use crate::features::Features;
use crate::grade::PictureGrade;
use crate::matching::{ImageEvidence, Match, guided_matches, matches};
use crate::shape_solver::ShapeSolver;
use crate::target::PictureTarget;
use deepsft_geometry::glam::{DVec3, Vec2};
use deepsft_geometry::{Camera, GeometryError, TRAINING_FOCAL, Template};

/// Least that the best mesh explains of an image's features for the search to go on to its last rounds: matches near it that agree with it, less
/// [`BY_CHANCE`] for each. Matches that came from elsewhere alone are few and rough: they have no such bound, nor the next.
const MIN_EXPLAINED: f64 = 8.0;

/// Least [`FeatureFinder::significance`] of the best mesh. Fits to wrong ones are found at times: of 144 synthetic frames of another print
/// of the same kind 24 have as much, 40 have 11, and 12 have 15. Of 123 right ones that have 11, three have less.
const MIN_SIGNIFICANCE: f64 = 13.0;

/// About what a wrong match counts that was found near a wrong mesh, and pulled at it: without it the mesh that covers most of the image
/// wins. On six frames of cards of fine print it was 0.3 to 0.5, for right groups 0.3 to 0.8.
const BY_CHANCE: f64 = 0.3;

/// Least and greatest distance in the image at which matches confirm each other, pixels.
const NEIGHBOURS_PX: [f64; 2] = [1.5, 58.0];

/// How exact places on the sheet are, pixels of the target's picture (2.5 mm on an A4 sheet).
const PLACE_PX: f32 = 5.4;

/// Standard deviation of the first matches, pixels.
const FIRST_DEVIATION_PX: f64 = 3.0;

/// Error of a match that counts half when meshes are compared, pixels.
const HALF_PX: f64 = 2.0;

/// What a mesh explains from which on no other group is tried.
const CLEAR: f64 = 40.0;

/// Within how many pixels of a group's mesh matches are looked for. Near the group it is exact; of a wider search on a print of fine
/// texture most matches are wrong, and pull the mesh away.
const TRIED_PX: f64 = 8.0;

/// Side of the squares whose matches are held out together, pixels: those of one corner at several sizes are one.
const SQUARE_PX: f64 = 12.0;

/// Within how many pixels matches are looked for again, round by round. The mesh grows from the first group over the sheet,
/// then the matches have to be exact.
const SEARCH_PX: [f64; 5] = [16.0, 16.0, 10.0, 6.0, 5.0];

/// Standard deviation of matches, as a fraction of the distance within which they were looked for.
const DEVIATION: f64 = 0.2;

/// Two prints share a corner where it lies no farther apart, pixels of the target's picture, and its descriptors differ in no more of their
/// 256 bits: other colours, another resolution and a camera's noise change some of them.
const SHARED_PX: f32 = 4.0;
const SHARED_BITS: u16 = 64;

/// A template that was found: a sheet as its coarse mesh shows it, a solid in its rigid pose.
#[derive(Clone, Debug)]
pub struct FoundMesh {
    /// Vertices of the template's mesh, camera frame, mm: all of it, as if nothing hid it.
    pub vertices_camera: Vec<DVec3>,
    /// The matches that it was fitted to last. Right ones and wrong ones: the mesh is robust.
    pub matches: Vec<Match>,
}

/// Finds what is printed on one template in images, by matches of features.
#[derive(Debug)]
pub struct FeatureFinder {
    target: PictureTarget,
    solver: ShapeSolver,
}

impl FeatureFinder {
    /// Prepares everything that does not depend on the image, for what is printed on `template`.
    ///
    /// # Errors
    /// [`TemplateError::PrintSize`](deepsft_geometry::TemplateError::PrintSize) when a side is shorter than 5 mm or longer than 20 m.
    pub fn new(template: Template) -> Result<Self, GeometryError> {
        let target = PictureTarget::new(template)?;
        Ok(Self {
            solver: ShapeSolver::new(&target.template)?,
            target,
        })
    }

    /// The template with the print.
    pub fn template(&self) -> &Template {
        &self.target.template
    }

    /// Grades how well the picture will be found. Takes up to 50 ms.
    pub fn grade(&self) -> PictureGrade {
        PictureGrade::of_target(&self.target)
    }

    /// Returns the fraction of its corners that `other`'s picture has at the same places, both prints taken as equally large.
    pub fn shared_with(&self, other: &Self) -> f64 {
        let (own, others) = (&self.target, &other.target);
        let to_other = (others.template.size_mm() / own.template.size_mm()).as_vec2();
        let is_shared = |(place, descriptor): &(&Vec2, &Descriptor)| {
            let mut near = others.near(**place * to_other, SHARED_PX * others.mm_per_pixel);
            near.any(|there| descriptor.distance(&others.features.descriptors[there]) <= SHARED_BITS)
        };
        let corners = own.places.iter().zip(&own.features.descriptors);
        corners.filter(is_shared).count() as f64 / own.places.len().max(1) as f64
    }

    /// Matches `features` of an image with those of the picture, the clearest first: right ones and wrong ones, before neighbours confirm
    /// any. Pixels are those of the camera that [`Features::of`] gives.
    pub fn matches(&self, features: &Features) -> Vec<Match> {
        matches(features, &self.target)
    }

    /// Finds the picture among `features` of an image that `camera` took. `None` when too few matches agree. A sheet that is found
    /// may still be a mistake: its fit to the image decides.
    ///
    /// # Errors
    /// [`GeometryError`] when the solver refuses its input.
    pub fn find(&mut self, features: &Features, camera: &Camera) -> Result<Option<FoundMesh>, GeometryError> {
        self.find_among(&self.matches(features), features, camera)
    }

    /// As [`Self::find`], among `candidates` that were matched elsewhere, the clearest first. The mesh gathers more matches from
    /// `features`, which may be empty: it then lives on the candidates alone.
    ///
    /// # Errors
    /// As [`Self::find`].
    pub fn find_among(
        &mut self,
        candidates: &[Match],
        features: &Features,
        camera: &Camera,
    ) -> Result<Option<FoundMesh>, GeometryError> {
        let pixel = pixel(camera);
        let apart = NEIGHBOURS_PX.map(|distance| (distance * pixel) as f32);
        let seen = ImageEvidence {
            candidates,
            features,
            camera,
        };
        let groups = groups(candidates, apart, PLACE_PX * self.target.mm_per_pixel);
        let mut best: Option<(f64, Vec<DVec3>)> = None;
        for group in &groups {
            for start in self.solver.flat_starts(camera, group) {
                let tried = self.tried(&seen, group, &start)?;
                if let Some(tried) = tried.filter(|(score, _)| best.as_ref().is_none_or(|(most, _)| score > most)) {
                    best = Some(tried);
                }
            }
            if best.as_ref().is_some_and(|(explained, _)| *explained >= CLEAR) {
                break;
            }
        }
        let Some((explained, mut vertices)) = best else {
            return Ok(None);
        };
        if !features.is_empty()
            && (explained < MIN_EXPLAINED || self.significance(&seen, &vertices)? < MIN_SIGNIFICANCE)
        {
            return Ok(None);
        }
        let mut last = Vec::new();
        for search in SEARCH_PX.map(|search| search * pixel) {
            last = guided_matches(&seen, &self.target, (self.solver.mesh(), &vertices), search)?;
            if last.len() < SMALLEST_GROUP {
                return Ok(None);
            }
            vertices = self.solver.bend(camera, &last, &vertices, DEVIATION * search, false)?;
        }
        Ok(Some(FoundMesh {
            vertices_camera: self.solver.template_vertices(vertices),
            matches: last,
        }))
    }

    /// The mesh bent to a group's matches from a flat start, then to all matches near it, and how many of these it explains.
    fn tried(
        &mut self,
        seen: &ImageEvidence<'_>,
        group: &[Match],
        start: &[DVec3],
    ) -> Result<Option<(f64, Vec<DVec3>)>, GeometryError> {
        let camera = seen.camera;
        let pixel = pixel(camera);
        let deviation = FIRST_DEVIATION_PX * pixel;
        let vertices = self.solver.bend(camera, group, start, deviation, true)?;
        let mesh = (self.solver.mesh(), &vertices[..]);
        let near = guided_matches(seen, &self.target, mesh, TRIED_PX * pixel)?;
        if near.len() < SMALLEST_GROUP {
            return Ok(None);
        }
        let vertices = self.solver.bend(camera, &near, &vertices, deviation, false)?;
        let agreement = self.solver.agreement(camera, &near, &vertices, HALF_PX * pixel);
        Ok(Some((agreement - BY_CHANCE * near.len() as f64, vertices)))
    }

    /// How far the matches near a mesh agree with it beyond chance, in standard deviations, by cross-validation: the mesh is bent to those in every
    /// other square of the image and compared with the rest, and the other way round. Wrong matches lie anywhere in the disc where
    /// they were looked for.
    fn significance(&mut self, seen: &ImageEvidence<'_>, vertices: &[DVec3]) -> Result<f64, GeometryError> {
        let camera = seen.camera;
        let pixel = pixel(camera);
        let near = guided_matches(seen, &self.target, (self.solver.mesh(), vertices), TRIED_PX * pixel)?;
        let mut agreement = 0.0;
        for half in [0, 1] {
            let is_held_out =
                |m: &Match| (m.pixel.as_dvec2() / (SQUARE_PX * pixel)).as_ivec2().element_sum() & 1 == half;
            let (held_out, rest): (Vec<Match>, Vec<Match>) = near.iter().partition(|m| is_held_out(m));
            let deviation = FIRST_DEVIATION_PX * pixel;
            let bent = self.solver.bend(camera, &rest, vertices, deviation, false)?;
            agreement += self.solver.agreement(camera, &held_out, &bent, HALF_PX * pixel);
        }
        // Mean and variance of what a match counts whose place is uniform in the disc.
        let area = (TRIED_PX / HALF_PX).powi(2);
        let mean = area.ln_1p() / area;
        let variance = 1.0 / (1.0 + area) - mean * mean;
        let count = near.len().max(1) as f64;
        Ok((agreement - mean * count) / (variance * count).sqrt())
    }
}

/// Pixels of the camera's image per pixel of the canonical one.
fn pixel(camera: &Camera) -> f64 {
    camera.focal().x / TRAINING_FOCAL
}
