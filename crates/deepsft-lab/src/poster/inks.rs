//! The poster's palette: saturated, printable, and spread over the whole range of luminance so that the
//! artwork reads in grey.

use super::canvas::Ink;

pub(super) const INK: Ink = [18, 22, 48];
pub(super) const NAVY: Ink = [24, 40, 92];
pub(super) const BLUE: Ink = [32, 92, 178];
pub(super) const SKY: Ink = [104, 188, 232];
pub(super) const ICE: Ink = [200, 234, 244];
pub(super) const TEAL: Ink = [8, 104, 116];
pub(super) const SEA: Ink = [22, 150, 146];
pub(super) const MINT: Ink = [160, 222, 200];
pub(super) const FOREST: Ink = [14, 62, 46];
pub(super) const LEAF: Ink = [58, 140, 62];
pub(super) const LIME: Ink = [184, 208, 58];
pub(super) const CREAM: Ink = [255, 244, 216];
pub(super) const SAND: Ink = [246, 212, 136];
pub(super) const GOLD: Ink = [246, 178, 36];
pub(super) const ORANGE: Ink = [240, 114, 36];
pub(super) const RED: Ink = [206, 34, 54];
pub(super) const WINE: Ink = [110, 18, 60];
pub(super) const CORAL: Ink = [252, 118, 106];
pub(super) const PINK: Ink = [250, 184, 196];
pub(super) const MAGENTA: Ink = [196, 44, 132];
pub(super) const PLUM: Ink = [78, 32, 108];
pub(super) const VIOLET: Ink = [134, 92, 204];
pub(super) const BROWN: Ink = [112, 60, 34];
