//! ChArUco boards: a checkerboard with a marker in each white square.

use crate::error::CalibrationError;
use calib_targets_aruco::builtins::DICT_4X4_50;
use calib_targets_charuco::{CharucoBoard, CharucoBoardSpec};
use deepsft_geometry::glam::DVec2;

/// Side of a marker as a fraction of its square's.
const MARKER_FRACTION: f64 = 0.75;

/// White bits reach so far beyond their cells, mm: no hairline of black is left between neighbours.
const OVERLAP_MM: f64 = 0.02;

/// A ChArUco board with 4 x 4 markers of 0.75 squares: OpenCV's `CharucoBoard` with `DICT_4X4_50`.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    pub(crate) spec: CharucoBoardSpec,
    square_mm: f64,
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
        CharucoBoard::new(spec).map_err(|error| CalibrationError::Board(error.to_string()))?;
        Ok(Self { spec, square_mm })
    }

    /// Width and height, mm.
    pub fn size_mm(&self) -> DVec2 {
        DVec2::new(f64::from(self.spec.cols), f64::from(self.spec.rows)) * self.square_mm
    }

    /// Draws the board from `top_left` (mm): black squares, the first among them, and in each white one the next marker, black with white
    /// bits. Later patches cover earlier ones.
    pub fn patches(&self, top_left: DVec2) -> Vec<BoardPatch> {
        let square = self.square_mm;
        let bits = self.spec.dictionary.marker_size();
        let marker = MARKER_FRACTION * square;
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
            let corner = top_left + DVec2::new(f64::from(column), f64::from(row)) * square;
            if (row + column) % 2 == 0 {
                patch(corner, square, true);
                continue;
            }
            let corner = corner + (1.0 - MARKER_FRACTION) / 2.0 * square;
            patch(corner, marker, true);
            let code = codes.next().copied().unwrap_or_default();
            for bit in (0..bits * bits).filter(|bit| code >> bit & 1 == 0) {
                let at = DVec2::new((bit % bits + 1) as f64, (bit / bits + 1) as f64);
                patch(corner + at * cell - OVERLAP_MM, cell + 2.0 * OVERLAP_MM, false);
            }
        }
        patches
    }
}
