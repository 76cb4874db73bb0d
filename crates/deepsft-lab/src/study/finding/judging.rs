//! One print with all finders: every frame is searched by each, fitted from what each found, and compared with the truth.

use super::finders::{Others, find};
use super::prints::{Kind, Print};
use crate::measuring::{Stopwatch, median};
use crate::study::frames::{frames_config, within_deviations};
use anyhow::Result;
use deepsft::{Finder, View};
use deepsft_geometry::fitting::{FrameFitter, Start};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, CanonicalWarp, Maps, Picture, Verdict, metrics, training_camera};
use deepsft_synth::{Synthesizer, canonical_truth};
use serde::Serialize;

/// Bars of the table: median registration errors, pixels of the canonical image.
pub const START_PX: f64 = 8.0;
pub const FITTED_PX: f64 = 2.0;

/// What became of one frame with one finder.
#[derive(Clone, Debug, Serialize)]
pub struct Attempt {
    pub finder: &'static str,
    /// Whether there was a sheet to fit.
    pub started: bool,
    /// Median registration errors of the finder's sheet and of the fitted one. `None` where less than half of the visible sheet
    /// has a registration.
    pub start_px: Option<f64>,
    pub fitted_px: Option<f64>,
    /// Root mean square distances of the fitted surface from the true one, mm: over the visible points, over all vertices.
    pub points_rmse_mm: Option<f64>,
    pub vertices_rmse_mm: Option<f64>,
    /// Fractions of the vertices within one and two of their stated standard deviations of the truth, of a fit whose shape is
    /// determined.
    pub within_deviations: Option<[f64; 2]>,
    /// Whether the fit counts as found. Its correlation with the image, the fraction of the print that the image confirms, and
    /// its size in pixels; 0 without a fit.
    pub is_found: bool,
    pub correlation: f64,
    pub explained: f64,
    pub confirmed_px: f64,
    /// What the image confirms of the next place that looks alike, as a fraction.
    pub ambiguity: Option<f64>,
    pub features_ms: f64,
    pub find_ms: f64,
    pub fit_ms: f64,
}

impl Attempt {
    pub fn is_fitted(&self) -> bool {
        self.fitted_px.is_some_and(|error| error < FITTED_PX)
    }
}

#[derive(Serialize)]
pub struct FrameResult {
    pub print: usize,
    pub kind: Kind,
    pub subject: &'static str,
    pub index: u64,
    /// Whether it shows the print, or another in its place.
    pub shown: bool,
    /// Median distance of the visible sheet, mm, and its pixels in the canonical image.
    pub distance_mm: Option<f64>,
    pub visible_px: usize,
    pub attempts: Vec<Attempt>,
}

impl FrameResult {
    /// The attempt of which the image confirms most.
    pub fn best(&self) -> Option<&Attempt> {
        let worth = |attempt: &Attempt| attempt.explained * attempt.confirmed_px;
        self.attempts.iter().max_by(|a, b| {
            let found = a.is_found.cmp(&b.is_found);
            found.then_with(|| worth(a).total_cmp(&worth(b)))
        })
    }

    /// Whether the print is shown and not within 2 px of the truth, or is not shown and found.
    pub fn is_failure(&self) -> bool {
        let best = self.best();
        best.is_some_and(|best| if self.shown { !best.is_fitted() } else { best.is_found })
    }
}

/// A print with everything that looks for it.
pub struct Studied<'a> {
    print: &'a Print,
    number: usize,
    finders: Vec<Finder>,
    shown: Synthesizer,
    another: Synthesizer,
    camera: Camera,
    canonical: Camera,
    fitter: FrameFitter,
}

impl<'a> Studied<'a> {
    /// Print `number` of `prints`; the next of its kind stands in its place where it is absent.
    pub fn new(prints: &'a [Print], number: usize, others: &Others) -> Result<Self> {
        let print = &prints[number];
        let same = |k: &usize| prints[*k].kind == print.kind;
        let next = (1..prints.len()).map(|k| (number + k) % prints.len());
        let other = next.clone().find(same).or(next.clone().next()).unwrap_or(number);
        let mut config = frames_config()?;
        config.min_visible_px *= 4;
        Ok(Self {
            print,
            number,
            finders: others.finders(print)?,
            camera: config.camera,
            shown: Synthesizer::new(&print.template, config.clone())?,
            another: Synthesizer::new(&prints[other].template, config)?,
            canonical: training_camera(),
            fitter: FrameFitter::new(&print.template)?,
        })
    }

    /// Frame `index` of the data set `seed` and its image.
    pub fn frame(&mut self, seed: u64, index: u64, shown: bool) -> Result<(FrameResult, Picture)> {
        let synthesizer = if shown { &self.shown } else { &self.another };
        let sample = synthesizer.sample(seed, index);
        let truth = shown.then(|| canonical_truth(&sample, self.print.template.mesh(), &self.canonical));
        let attempts = self.attempts(
            &sample.image,
            truth.as_ref().map(|maps| (maps, &sample.vertices_camera[..])),
        )?;
        let visible = truth
            .iter()
            .flat_map(|maps| maps.depth().iter())
            .filter(|&&depth| depth > 0.0);
        let result = FrameResult {
            print: self.number,
            kind: self.print.kind,
            subject: self.print.subject,
            index,
            shown,
            distance_mm: median(visible.clone().map(|&depth| f64::from(depth))),
            visible_px: visible.count(),
            attempts,
        };
        Ok((result, sample.image))
    }

    fn attempts(&mut self, image: &Picture, truth: Option<(&Maps, &[DVec3])>) -> Result<Vec<Attempt>> {
        let canonical = CanonicalWarp::new(&self.camera, &self.canonical).apply(image)?;
        let mut attempts = Vec::new();
        for finder in &mut self.finders {
            let (found, [features_ms, find_ms]) = find(finder, View::new(image, &self.camera), &self.canonical)?;
            let mesh = self.print.template.mesh();
            let error = |maps: &Maps| error_px(maps, truth?.0, self.print, &self.canonical);
            let start_px = found.as_ref().and_then(|start| match start {
                Start::Maps(maps) => error(maps),
                Start::Mesh(vertices) => error(&VisibleSurface::new(mesh, vertices, &self.canonical).maps()),
            });
            let stopwatch = Stopwatch::start();
            let fit = found
                .as_ref()
                .map(|start| self.fitter.fit(&canonical, &self.canonical, start));
            let fit = fit.transpose()?.flatten();
            let fit = fit.map(|surface| self.fitter.fit_close_ups(image, &self.camera, surface));
            let fit = fit.transpose()?;
            let fit_ms = stopwatch.ms();
            let maps = fit.as_ref().map(|surface| surface.maps(mesh));
            let size_mm = self.print.template.size_mm();
            let points = maps.as_ref().zip(truth);
            let points = points.map(|(maps, (truth, _))| metrics::frame_metrics(maps, truth, &self.canonical, size_mm));
            let vertices = fit.as_ref().zip(truth);
            let verdict = fit.as_ref().map_or_else(Verdict::default, |surface| surface.verdict);
            attempts.push(Attempt {
                finder: finder.kind().name(),
                started: found.is_some(),
                start_px,
                fitted_px: maps.as_ref().and_then(error),
                points_rmse_mm: points.transpose()?.and_then(|metrics| metrics.points_rmse_mm),
                vertices_rmse_mm: vertices.and_then(|(fit, (_, truth))| distance_rmse(&fit.vertices_camera, truth)),
                within_deviations: vertices
                    .filter(|(fit, _)| fit.is_shape_determined())
                    .map(|(fit, (_, truth))| within_deviations(fit, truth)),
                is_found: verdict.is_found(),
                ambiguity: verdict.ambiguity,
                correlation: verdict.correlation,
                explained: verdict.explained,
                confirmed_px: verdict.confirmed_px,
                features_ms,
                find_ms,
                fit_ms,
            });
        }
        Ok(attempts)
    }
}

/// Root mean square distance of two lists of points; `None` of nothing.
fn distance_rmse(points: &[DVec3], truth: &[DVec3]) -> Option<f64> {
    let squares = points.iter().zip(truth).map(|(a, b)| Some(a.distance_squared(*b)));
    metrics::Summary::of(squares).map(|squares| squares.mean.sqrt())
}

/// Median distance of a registration from the true one over the visible sheet, pixels; `None` when most of it has none.
fn error_px(maps: &Maps, truth: &Maps, print: &Print, camera: &Camera) -> Option<f64> {
    let error = |pixel: usize| {
        if !maps.inside(pixel) {
            return f64::INFINITY;
        }
        let off = ((truth.uv(pixel) - maps.uv(pixel)) * print.template.size_mm()).length();
        off * camera.focal().x / f64::from(truth.depth()[pixel])
    };
    let pixels = (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel));
    median(pixels.map(error)).filter(|error| error.is_finite())
}
