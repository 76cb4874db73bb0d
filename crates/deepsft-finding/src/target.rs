//! The target: a printed picture, ready to be found.

use crate::features::{FeatureOptions, Features};
use crate::pyramid::resized;
use deepsft_geometry::glam::Vec2;
use deepsft_geometry::{GeometryError, Picture, Template, TemplateError, luma};

/// Longest side of the picture that corners are taken from, pixels: an A4 sheet then has 2 pixels per mm, as a camera with
/// 960 columns sees it 35 cm away.
const LONGEST_SIDE: usize = 640;

/// The same of a solid.
const SOLID_LONGEST_SIDE: usize = 1280;

/// Side of the cells in which features are looked up by place, pixels of the picture that corners are taken from.
const CELL_PX: f32 = 17.0;

/// Shortest and longest side of a print, mm: a stamp is 20 mm wide, a banner 10 m. Beyond them a number has another unit.
const SIDES_MM: [f64; 2] = [5.0, 20_000.0];

/// A printed picture with its features, on a flat sheet of known size in mm; or the texture of a solid, whose places are mm along it.
#[derive(Debug)]
pub(crate) struct PictureTarget {
    pub template: Template,
    pub features: Features,
    /// Of each feature: its place on the sheet, mm from the upper left corner.
    pub places: Vec<Vec2>,
    /// mm on the sheet per pixel of the picture that corners were taken from.
    pub mm_per_pixel: f32,
    /// Indices of the features in each cell of the sheet, row-major.
    cells: Vec<Vec<usize>>,
    columns: usize,
    /// Grey levels between the darkest and the brightest hundredth of the picture.
    pub contrast: u8,
}

impl PictureTarget {
    /// Prepares `template`, whose texture has sides that a print can have.
    pub fn new(template: Template) -> Result<Self, GeometryError> {
        let [shortest, longest] = SIDES_MM;
        let size = template.size_mm();
        if size.min_element() < shortest || size.max_element() > longest {
            return Err(TemplateError::PrintSize(size, SIDES_MM).into());
        }
        // The texture of a solid has all of its sides, as fine as a sheet's.
        let (longest_side, corners) = match template.is_sheet() {
            true => (LONGEST_SIDE, 4000),
            false => (SOLID_LONGEST_SIDE, 8000),
        };
        let picture = resized(template.texture(), longest_side);
        let options = FeatureOptions {
            corners,
            longest_side: 0,
            levels: 10,
            threshold: 6,
        };
        let features = Features::search(&picture, options);
        let contrast = contrast(&picture);
        let size = template.size_mm().as_vec2();
        let scale = size / Vec2::new(picture.width() as f32, picture.height() as f32);
        let places: Vec<Vec2> = features.all.iter().map(|f| f.position * scale).collect();
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
            contrast,
        })
    }

    /// mm on the sheet per pixel of the level that has feature `index`.
    pub fn scale_mm(&self, index: usize) -> f32 {
        self.features.all[index].scale * self.mm_per_pixel
    }

    /// The features whose places are at most `reach` mm from `place`.
    pub fn near(&self, place: Vec2, reach: f32) -> impl Iterator<Item = usize> {
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

fn contrast(picture: &Picture) -> u8 {
    let mut grey: Vec<u8> = picture.rgb().as_chunks().0.iter().map(|&c| luma(c) as u8).collect();
    grey.sort_unstable();
    let hundredth = grey.len() / 100;
    grey[grey.len() - 1 - hundredth] - grey[hundredth]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(picture: Picture, width_mm: f64) -> Result<PictureTarget, GeometryError> {
        let height_mm = width_mm * picture.height() as f64 / picture.width() as f64;
        PictureTarget::new(Template::thin_shell(picture, width_mm, height_mm)?)
    }

    #[test]
    fn features_are_looked_up_by_place() {
        let picture = Picture::from_fn(300, 200, |x, y| [((x / 9 * 37 + y / 7 * 91) % 251) as u8; 3]);
        let target = print(picture, 150.0).unwrap();
        assert!(target.places.len() > 100, "{}", target.places.len());
        for (place, reach) in [(Vec2::new(40.0, 30.0), 13.0), (Vec2::new(149.0, 1.0), 30.0)] {
            let mut near: Vec<usize> = target.near(place, reach).collect();
            near.sort_unstable();
            let all = (0..target.places.len()).filter(|&i| target.places[i].distance(place) <= reach);
            assert_eq!(near, all.collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_size_that_no_print_has_is_refused_with_the_sizes_that_are_taken() {
        let square = |width_mm: f64| print(Picture::from_fn(9, 9, |_, _| [0; 3]), width_mm);
        for width_mm in [1e-9, 4.9, 20_001.0, 1e9] {
            let message = square(width_mm).unwrap_err().to_string();
            assert!(message.ends_with("expected sides from 5 to 20000 mm"), "{message}");
        }
        for width_mm in [5.0, 20_000.0] {
            assert!(square(width_mm).is_ok(), "{width_mm}");
        }
        // The other side counts too: one pixel wide and 400 high.
        let line = Picture::from_fn(1, 400, |_, _| [0; 3]);
        assert!(matches!(
            print(line, 100.0),
            Err(GeometryError::Template(TemplateError::PrintSize { .. }))
        ));
    }
}
