//! A printed picture, ready to be found.

use crate::features::{FeatureOptions, Features};
use crate::pyramid::resized;
use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{GeometryError, Picture, Template};

/// Longest side of the picture that corners are taken from, pixels: an A4 sheet then has 2 pixels per mm, as a camera with
/// 960 columns sees it 35 cm away.
const LONGEST_SIDE: usize = 640;

/// Side of the cells in which features are looked up by place, pixels of the picture that corners are taken from.
const CELL_PX: f32 = 17.0;

/// A printed picture with its features, on a flat sheet of known size.
#[derive(Clone, Debug)]
pub struct PictureTarget {
    template: Template,
    features: Features,
    /// Of each feature: its place on the sheet, mm from the upper left corner.
    places: Vec<Vec2>,
    /// mm per pixel of the picture that corners were taken from.
    mm_per_pixel: f32,
    /// Indices of the features in each cell of the sheet, row-major.
    cells: Vec<Vec<usize>>,
    columns: usize,
}

impl PictureTarget {
    /// Prepares a picture that is printed `width_mm` wide.
    ///
    /// # Errors
    /// [`GeometryError::TemplateSize`] when the width is not positive and finite.
    pub fn picture(picture: Picture, width_mm: f64) -> Result<Self, GeometryError> {
        let height_mm = width_mm * picture.height() as f64 / picture.width() as f64;
        Self::new(Template::thin_shell(picture, width_mm, height_mm)?)
    }

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
        let features = Features::of(&picture, &options).kept();
        let size = template.size_mm().as_vec2();
        let scale = size / Vec2::new(picture.width() as f32, picture.height() as f32);
        let places: Vec<Vec2> = features.all().iter().map(|f| f.position * scale).collect();
        let mm_per_pixel = scale.element_sum() / 2.0;
        let cell_mm = CELL_PX * mm_per_pixel;
        let [columns, rows] = [size.x, size.y].map(|side| (side / cell_mm) as usize + 1);
        let mut cells = vec![Vec::new(); columns * rows];
        for (i, place) in places.iter().enumerate() {
            let (x, y) = ((place.x / cell_mm) as usize, (place.y / cell_mm) as usize);
            cells[y.min(rows - 1) * columns + x.min(columns - 1)].push(i);
        }
        Ok(Self {
            template,
            features,
            places,
            mm_per_pixel,
            cells,
            columns,
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

    /// Places of the features on the sheet, mm from its upper left corner.
    pub(crate) fn places(&self) -> &[Vec2] {
        &self.places
    }

    /// mm on the sheet per pixel of the picture that corners were taken from.
    pub(crate) fn mm_per_pixel(&self) -> f32 {
        self.mm_per_pixel
    }

    /// mm on the sheet per pixel of the level that has feature `index`.
    pub(crate) fn scale_mm(&self, index: usize) -> f32 {
        self.features.all()[index].scale * self.mm_per_pixel
    }

    /// The features whose places are at most `reach` mm from `place`.
    pub(crate) fn near(&self, place: Vec2, reach: f32) -> impl Iterator<Item = usize> {
        let (rows, cell_mm) = (self.cells.len() / self.columns, CELL_PX * self.mm_per_pixel);
        let cells = move |at: f32, count: usize| {
            let cell = |at: f32| ((at / cell_mm).max(0.0) as usize).min(count - 1);
            cell(at - reach)..=cell(at + reach)
        };
        let columns = cells(place.x, self.columns);
        cells(place.y, rows)
            .flat_map(move |row| columns.clone().map(move |column| row * self.columns + column))
            .flat_map(|cell| self.cells[cell].iter().copied())
            .filter(move |&i| self.places[i].distance(place) <= reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_looked_up_by_place() {
        let picture = Picture::from_fn(300, 200, |x, y| [((x / 9 * 37 + y / 7 * 91) % 251) as u8; 3]);
        let target = PictureTarget::picture(picture, 150.0).unwrap();
        assert!(target.places.len() > 100, "{}", target.places.len());
        for (place, reach) in [(Vec2::new(40.0, 30.0), 13.0), (Vec2::new(149.0, 1.0), 30.0)] {
            let mut near: Vec<usize> = target.near(place, reach).collect();
            near.sort_unstable();
            let all = (0..target.places.len()).filter(|&i| target.places[i].distance(place) <= reach);
            assert_eq!(near, all.collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_blank_or_tiny_picture_has_no_features_and_a_width_must_be_one() {
        for (width, height) in [(3, 3), (1, 400), (300, 200)] {
            let blank = Picture::from_fn(width, height, |_, _| [200; 3]);
            assert!(PictureTarget::picture(blank, 100.0).unwrap().features().is_empty());
        }
        for width_mm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let picture = Picture::from_fn(9, 9, |_, _| [0; 3]);
            assert!(PictureTarget::picture(picture, width_mm).is_err(), "{width_mm}");
        }
    }
}
