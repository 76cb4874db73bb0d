//! ChArUco boards: a checkerboard with a marker in each white square.

use crate::error::CalibrationError;
use calib_targets_aruco::{Dictionary, builtins::DICT_4X4_50, resolve_dictionary};
use calib_targets_charuco::{CharucoBoard, CharucoBoardSpec};
use deepsft_geometry::glam::DVec2;

/// Side of a marker as a fraction of its square's.
const MARKER_FRACTION: f64 = 0.75;

/// White bits reach so far beyond their cells, mm: no hairline of black is left between neighbours.
const OVERLAP_MM: f64 = 0.02;

/// A ChArUco board: OpenCV's `CharucoBoard`, with `DICT_4X4_50` and markers of 0.75 squares unless others are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    pub(crate) spec: CharucoBoardSpec,
    square_mm: f64,
    /// Rows of the specification above the board that is printed.
    rows_above: u32,
}

/// A black or white square in the drawing of a board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardPatch {
    /// Its top left corner, mm.
    pub top_left: DVec2,
    /// Its side, mm.
    pub side: f64,
    /// Whether it is black.
    pub is_black: bool,
}

impl Board {
    /// The board of `columns` x `rows` squares of `square_mm`.
    ///
    /// # Errors
    /// [`CalibrationError::Board`] for fewer than 2 x 2 squares, more white squares than the 50 markers, or a side that is not positive.
    pub fn new(columns: u32, rows: u32, square_mm: f64) -> Result<Self, CalibrationError> {
        let spec = CharucoBoardSpec::new(rows, columns, square_mm as f32, MARKER_FRACTION as f32, DICT_4X4_50);
        Self {
            spec,
            square_mm,
            rows_above: 0,
        }
        .checked()
    }

    fn checked(self) -> Result<Self, CalibrationError> {
        let fraction = self.spec.marker_size_rel;
        if !(fraction > 0.0 && fraction < 1.0) {
            let reason = format!("its markers are {fraction} of a square, expected a fraction between 0 and 1");
            return Err(CalibrationError::Board(reason));
        }
        let remedy = |error| format!("{error}: ask for fewer squares, or for another dictionary");
        CharucoBoard::new(self.spec).map_err(|error| CalibrationError::Board(remedy(error)))?;
        Ok(self)
    }

    /// The same with markers of another of OpenCV's dictionaries (`DICT_5X5_100`, `5x5_100`), whose side is this fraction of a square's.
    ///
    /// # Errors
    /// [`CalibrationError::Board`] for an unknown dictionary, one with too few markers, and a fraction that is not between 0 and 1.
    pub fn with_markers(mut self, dictionary: &str, fraction: f64) -> Result<Self, CalibrationError> {
        let name = dictionary.to_uppercase();
        // Of names as APRILTAG_36h11 one letter is small.
        let small = name.replace("6H", "6h").replace("5H", "5h");
        let known = [name, small].iter().find_map(|name| resolve_dictionary(name));
        self.spec.dictionary = known.ok_or_else(|| {
            CalibrationError::Board(format!(
                "OpenCV has no dictionary {dictionary}; others are 4X4_50, 5X5_100, 6X6_250, 7X7_1000, ARUCO_ORIGINAL, APRILTAG_36h11"
            ))
        })?;
        self.spec.marker_size_rel = fraction as f32;
        self.checked()
    }

    /// The same as OpenCV printed it before 4.6 (`setLegacyPattern`): of an even number of rows, the first square is white. Call it after
    /// [`Board::with_markers`].
    ///
    /// # Errors
    /// [`CalibrationError::Board`] where the dictionary has too few markers to tell the rows apart.
    pub fn with_legacy_pattern(mut self) -> Result<Self, CalibrationError> {
        if !self.spec.rows.is_multiple_of(2) {
            return Ok(self);
        }
        // It is the newer pattern below one more row, whose markers nobody sees: the last of the dictionary.
        let (codes, above) = (self.spec.dictionary.codes(), self.spec.cols as usize / 2);
        let markers = (self.spec.rows * self.spec.cols).div_ceil(2) as usize;
        if markers + above > codes.len() {
            return Err(CalibrationError::Board(format!(
                "{} has {} markers, and a board of the older pattern needs {}: ask for fewer squares",
                self.spec.dictionary.name(),
                codes.len(),
                markers + above
            )));
        }
        let codes = [&codes[codes.len() - above..], &codes[..markers]].concat();
        let of = self.spec.dictionary;
        // A board is made once in a program, and its detector wants codes that last.
        let codes: &'static [u64] = codes.leak();
        let shifted = Dictionary::from_static_codes(of.name(), of.marker_size(), of.max_correction_bits(), codes);
        self.spec.dictionary = shifted.map_err(|error| CalibrationError::Board(error.to_string()))?;
        self.spec.rows += 1;
        self.rows_above = 1;
        self.checked()
    }

    /// Width and height, mm.
    pub fn size_mm(&self) -> DVec2 {
        DVec2::new(f64::from(self.spec.cols), f64::from(self.spec.rows - self.rows_above)) * self.square_mm
    }

    /// Draws the board from `top_left` (mm): black squares, the first among them but in the older pattern, and in each white one the next marker, black with white
    /// bits. Later patches cover earlier ones.
    pub fn patches(&self, top_left: DVec2) -> Vec<BoardPatch> {
        let square = self.square_mm;
        let bits = self.spec.dictionary.marker_size();
        let fraction = f64::from(self.spec.marker_size_rel);
        let marker = fraction * square;
        let cell = marker / (bits + 2) as f64;
        let mut patches = Vec::new();
        let mut patch = |top_left, side, is_black| {
            patches.push(BoardPatch {
                top_left,
                side,
                is_black,
            })
        };
        let mut codes = self.spec.dictionary.codes().iter();
        for (row, column) in (0..self.spec.rows).flat_map(|row| (0..self.spec.cols).map(move |column| (row, column))) {
            let is_black = (row + column) % 2 == 0;
            let code = if is_black { None } else { codes.next() };
            let Some(row) = row.checked_sub(self.rows_above) else {
                continue;
            };
            let corner = top_left + DVec2::new(f64::from(column), f64::from(row)) * square;
            let Some(&code) = code else {
                patch(corner, square, true);
                continue;
            };
            let corner = corner + (1.0 - fraction) / 2.0 * square;
            patch(corner, marker, true);
            for bit in (0..bits * bits).filter(|bit| code >> bit & 1 == 0) {
                let at = DVec2::new((bit % bits + 1) as f64, (bit / bits + 1) as f64);
                patch(corner + at * cell - OVERLAP_MM, cell + 2.0 * OVERLAP_MM, false);
            }
        }
        patches
    }
}
