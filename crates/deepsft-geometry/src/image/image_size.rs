//! The size of an image.

use glam::DVec2;
use std::fmt;

/// The size of an image, pixels. (columns, rows) convert into it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ImageSize {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl ImageSize {
    /// Number of pixels.
    pub fn area(self) -> usize {
        self.width.saturating_mul(self.height)
    }

    pub(crate) fn is_upright(self) -> bool {
        self.height > self.width
    }

    /// Half the size, rounded down.
    pub(crate) fn halved(self) -> Self {
        (self.width / 2, self.height / 2).into()
    }

    /// Whether an image position lies in the image, its border included.
    pub(crate) fn holds(self, at: DVec2) -> bool {
        at.cmpge(DVec2::ZERO).all() && at.cmple(self.as_dvec2()).all()
    }

    /// Width and height as a vector: the corner opposite to the origin.
    pub fn as_dvec2(self) -> DVec2 {
        DVec2::new(self.width as f64, self.height as f64)
    }
}

impl From<(usize, usize)> for ImageSize {
    fn from((width, height): (usize, usize)) -> Self {
        Self { width, height }
    }
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {}", self.width, self.height)
    }
}
