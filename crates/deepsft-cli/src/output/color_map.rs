//! Colours for numbers: matplotlib's viridis for depth, inferno for errors.

/// A colour map: a ramp of colours whose brightness rises evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorMap {
    /// Dark blue over green to yellow.
    Viridis,
    /// Black over red to pale yellow.
    Inferno,
}

/// Nine evenly spaced colours of viridis, as matplotlib has them.
const VIRIDIS: [u32; 9] = [
    0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725,
];

/// Nine evenly spaced colours of inferno.
const INFERNO: [u32; 9] = [
    0x000004, 0x210c4a, 0x57106e, 0x8a226a, 0xbc3754, 0xe45a31, 0xf98e09, 0xf9cb35, 0xfcffa4,
];

impl ColorMap {
    /// The colour of `value`, 0 to 1; what lies outside (or is no number) is taken as the nearer end (as 0).
    pub fn color(self, value: f64) -> [u8; 3] {
        let colors = match self {
            Self::Viridis => VIRIDIS,
            Self::Inferno => INFERNO,
        };
        let at = value.clamp(0.0, 1.0) * (colors.len() - 1) as f64;
        let first = (at as usize).min(colors.len() - 2);
        let fraction = (at - first as f64).max(0.0);
        std::array::from_fn(|k| {
            let channel = |color: u32| f64::from(color.to_be_bytes()[k + 1]);
            (channel(colors[first]) * (1.0 - fraction) + channel(colors[first + 1]) * fraction + 0.5) as u8
        })
    }
}
