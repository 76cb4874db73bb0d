//! DOF: the registration by dense optical flow, from frame to frame of a video.
//!
//! N. Sundaram, T. Brox, K. Keutzer, *Dense Point Trajectories by GPU-Accelerated Large Displacement Optical Flow*, ECCV 2010. DeepSfT
//! registers videos with it for CH17+DOF and CH17R+DOF, and measures its own registration against it.
//!
//! The template is drawn as the last frame registers it. The flow from the new image to the drawing ([`crate::flow`]) says of each pixel of
//! the new image which place of the template it shows.
//!
//! # Where we had to decide
//!
//! * Large displacement flow adds matches of descriptors to the energy. Ours goes from coarse to fine without: at 30 frames per second
//!   nothing of the sheet moves further than it is wide.
//! * Trajectories end where flow and backward flow disagree. Ours end where the drawing differs from the image by more than
//!   [`DIFFERENT`] grey levels, with mean and deviation alike: something hides the template there.
//! * What is hidden may come back. The template is drawn whole, through a B-spline warp of what is registered.
//! * The first frame of a video is registered by its truth. DeepSfT does not say how its sequences begin, and chooses those that go well.

use crate::flow::{Flow, Grey, flow};
use crate::frame::{at_least, correspondences, rays};
use crate::spline::{Spline, SplineGrid};
use anyhow::Result;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, ImageSize, Maps, Picture, Template, draw_template, luma};
use std::ops::Range;

/// Difference beyond which a pixel shows something else than the template, grey levels.
const DIFFERENT: f32 = 45.0;

/// Least and greatest gain between print and image.
const GAINS: [f32; 2] = [0.4, 1.6];

/// Cells of the warp, and the weight of its bending beside the mean squared error of rays.
const CELLS: usize = 12;
const BENDING: f64 = 1e-7;

/// Pixels around the drawing in which the template may be in the next frame.
const MARGIN_PX: usize = 32;

/// Fewest pixels that register the template.
const FEWEST: usize = 400;

/// Depth at which the warped template is drawn, mm: any.
const DRAWN_MM: f64 = 500.0;

/// The registration of a template that is followed through a video.
pub struct Dof {
    template: Template,
    registration: Maps,
}

impl Dof {
    /// Begins with the registration of the first frame.
    pub fn new(template: &Template, registration: Maps) -> Self {
        Self {
            template: template.clone(),
            registration,
        }
    }

    /// Registers the next `image`. Depths of the answer mean nothing.
    /// Fails when too little of the template is left.
    pub fn next(&mut self, image: &Picture, camera: &Camera) -> Result<&Maps> {
        let whole = self.whole(camera)?;
        let drawn = draw_template(self.template.texture(), &whole);
        let window = Window::around(&whole)?;
        let known = window.cut(|pixel| f32::from(whole.inside(pixel)));
        let width = image.width();
        let grey = |picture: &Picture, pixel: usize| luma(picture.pixel(pixel % width, pixel / width));
        let seen = window.cut(|pixel| grey(image, pixel));
        let drawn = alike(window.cut(|pixel| grey(&drawn, pixel)), &seen, &known);
        let found = flow(&seen, &drawn, &known);
        let registration = window.registered(&whole, &found, &seen, &drawn);
        at_least(registration.area(), FEWEST, "pixels register the template")?;
        self.registration = registration;
        Ok(&self.registration)
    }

    /// The maps of the whole template as the last frame registers it.
    fn whole(&self, camera: &Camera) -> Result<Maps> {
        let size_mm = self.template.size_mm();
        let seen = correspondences(&self.registration, camera, size_mm);
        let weight = 1.0 / seen.len().max(1) as f64;
        let warp = Spline::through(SplineGrid::new(size_mm, CELLS), rays(&seen), weight, BENDING)?;
        let vertex = |uv: &DVec2| DVec2::from(warp.value(*uv * size_mm)).extend(1.0) * DRAWN_MM;
        let vertices: Vec<DVec3> = self.template.mesh().texture_coordinates().iter().map(vertex).collect();
        Ok(VisibleSurface::new(self.template.mesh(), &vertices, camera).maps())
    }
}

/// `drawn` with the mean and the deviation that `seen` has where the drawing is `known`. The two may be several pixels apart, so nothing is
/// compared pixel by pixel.
fn alike(mut drawn: Grey, seen: &Grey, known: &Grey) -> Grey {
    let moments = |image: &Grey| {
        let pairs = image.values.iter().zip(&known.values);
        let known = pairs.filter(|(_, known)| **known > 0.5);
        let values: Vec<f32> = known.map(|(value, _)| *value).collect();
        let count = values.len().max(1) as f32;
        let mean = values.iter().sum::<f32>() / count;
        let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / count;
        (mean, square.sqrt().max(1.0))
    };
    let ((from, of), (to, as_far)) = (moments(&drawn), moments(seen));
    let gain = (as_far / of).clamp(GAINS[0], GAINS[1]);
    let values = drawn.values.iter_mut();
    values.for_each(|value| *value = (*value - from) * gain + to);
    drawn
}

/// The part of the image in which the template is looked for.
struct Window {
    image_width: usize,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Window {
    fn around(maps: &Maps) -> Result<Self> {
        let ImageSize { width, height } = maps.size();
        at_least(maps.area(), FEWEST, "pixels show the template")?;
        let inside = || (0..maps.depth().len()).filter(|&pixel| maps.inside(pixel));
        let range = |of: &dyn Fn(usize) -> usize, side: usize| {
            let low = inside().map(of).min().unwrap_or(0).saturating_sub(MARGIN_PX);
            low..(inside().map(of).max().unwrap_or(0) + MARGIN_PX + 1).min(side)
        };
        Ok(Self {
            image_width: width,
            columns: range(&|pixel| pixel % width, width),
            rows: range(&|pixel| pixel / width, height),
        })
    }

    /// The image's pixel at a place in the window.
    fn pixel(&self, x: usize, y: usize) -> usize {
        (y + self.rows.start) * self.image_width + x + self.columns.start
    }

    fn cut(&self, value: impl Fn(usize) -> f32) -> Grey {
        Grey::from_fn(self.columns.len(), self.rows.len(), |x, y| value(self.pixel(x, y)))
    }

    /// What the flow registers of the whole maps of the drawing, where the image is like it.
    fn registered(&self, whole: &Maps, [u, v]: &Flow, seen: &Grey, drawn: &Grey) -> Maps {
        let mut registration = Maps::empty(whole.size());
        for k in 0..seen.values.len() {
            let (x, y) = (k % seen.width, k / seen.width);
            let (to_x, to_y) = (x as f32 + u.values[k], y as f32 + v.values[k]);
            let is_within = |at: f32, side: usize| at >= 0.0 && at + 1.0 < side as f32;
            if is_within(to_x, seen.width)
                && is_within(to_y, seen.height)
                && (drawn.sample(to_x, to_y) - seen.values[k]).abs() <= DIFFERENT
                && let Some(uv) = self.sampled(whole, to_x, to_y)
            {
                registration.set(self.pixel(x, y), 1.0, uv.as_vec2().to_array());
            }
        }
        registration
    }

    /// The registration of the drawing between pixels of the window; `None` unless all four around show it.
    fn sampled(&self, maps: &Maps, x: f32, y: f32) -> Option<DVec2> {
        let first = self.pixel(x as usize, y as usize);
        let around = [first, first + 1, first + self.image_width, first + self.image_width + 1];
        let [a, b, c, d] = around.map(|pixel| maps.inside(pixel).then(|| maps.uv(pixel)));
        let (s, t) = (f64::from(x.fract()), f64::from(y.fract()));
        Some(a?.lerp(b?, s).lerp(c?.lerp(d?, s), t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::pattern;
    use crate::frame::tests::{SIZE_MM, cylinder};
    use deepsft_geometry::metrics::frame_metrics;
    use deepsft_geometry::training_camera;

    #[test]
    fn a_sheet_that_moves_by_five_pixels_a_frame_stays_registered() {
        let texture = Picture::from_fn(297, 210, |x, y| [pattern(x as f32, y as f32) as u8; 3]);
        let template = Template::thin_shell(texture, SIZE_MM.x, SIZE_MM.y).unwrap();
        let camera = training_camera();
        let truth = |frame: f64| {
            let at = |uv: &DVec2| {
                cylinder(*uv * SIZE_MM, 200.0, 0.03 * frame) + DVec3::new(6.5 * frame - 12.0, 2.0 * frame, 500.0)
            };
            let vertices: Vec<DVec3> = template.mesh().texture_coordinates().iter().map(at).collect();
            VisibleSurface::new(template.mesh(), &vertices, &camera).maps()
        };
        let mut dof = Dof::new(&template, truth(0.0));
        for frame in 1..4 {
            let truth = truth(f64::from(frame));
            // A darker image than the print.
            let drawn = draw_template(template.texture(), &truth);
            let image = Picture::from_fn(480, 270, |x, y| match truth.inside(y * 480 + x) {
                true => drawn.pixel(x, y).map(|c| (f32::from(c) * 0.8) as u8),
                false => [128; 3],
            });
            let registered = dof.next(&image, &camera).unwrap();
            let metrics = frame_metrics(registered, &truth, &camera, SIZE_MM).unwrap();
            let (error, covered) = (metrics.registration_rmse_px.unwrap(), metrics.coverage.unwrap());
            assert!(error < 0.5 && covered > 0.9, "frame {frame}: {error} px, {covered}");
        }
    }
}
