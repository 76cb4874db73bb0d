//! A printed picture, ready to be found.

use crate::features::{FeatureOptions, Features};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{GeometryError, Picture, Template};

/// Longest side of the picture that corners are taken from, pixels: an A4 sheet then has 2 pixels per mm, as a camera with
/// 960 columns sees it 35 cm away.
const LONGEST_SIDE: usize = 640;

/// A printed picture with its features, on a flat sheet of known size.
#[derive(Clone, Debug)]
pub struct PictureTarget {
    template: Template,
    features: Features,
    /// Of each feature: its place on the sheet, mm from the upper left corner.
    pub(crate) places: Vec<[f32; 2]>,
    /// mm per pixel of the picture that corners were taken from.
    pub(crate) mm_per_pixel: f32,
}

impl PictureTarget {
    /// Prepares `template`, a sheet.
    ///
    /// # Errors
    /// [`GeometryError::NotASheet`] for a template of another shape.
    pub fn new(template: Template) -> Result<Self, GeometryError> {
        if !template.is_sheet() {
            return Err(GeometryError::NotASheet {
                operation: "finding by features",
            });
        }
        let picture = resized(template.texture(), LONGEST_SIDE);
        let options = FeatureOptions {
            corners: 4000,
            levels: 10,
            threshold: 6,
        };
        let features = Features::of(&picture, &options);
        let pixels = DVec2::new(picture.width() as f64, picture.height() as f64);
        let scale = (template.size_mm() / pixels).as_vec2();
        let places = features
            .all
            .iter()
            .map(|f| [f.position[0] * scale.x, f.position[1] * scale.y])
            .collect();
        Ok(Self {
            template,
            features,
            places,
            mm_per_pixel: (scale.x + scale.y) / 2.0,
        })
    }

    /// The sheet.
    pub fn template(&self) -> &Template {
        &self.template
    }

    /// Its features.
    pub fn features(&self) -> &Features {
        &self.features
    }
}

/// The picture with its longest side at most `longest` pixels.
pub(crate) fn resized(picture: &Picture, longest: usize) -> Picture {
    let mut picture = picture.clone();
    while picture.width().max(picture.height()) >= 2 * longest {
        picture = picture.halved();
    }
    let side = picture.width().max(picture.height());
    if side <= longest {
        return picture;
    }
    let to = |length: usize| ((length * longest) as f64 / side as f64).round().max(1.0) as usize;
    let (width, height) = (to(picture.width()), to(picture.height()));
    let (across, down) = (
        picture.width() as f64 / width as f64,
        picture.height() as f64 / height as f64,
    );
    // Four samples per pixel: the picture shrinks by less than two.
    Picture::from_fn(width, height, |x, y| {
        let mut sum = [0.0_f32; 3];
        for (i, j) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let color = picture.sample((x as f64 + i) * across, (y as f64 + j) * down);
            sum.iter_mut().zip(color).for_each(|(s, c)| *s += c / 4.0);
        }
        sum.map(|s| (s + 0.5) as u8)
    })
}
