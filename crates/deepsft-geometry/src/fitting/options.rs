//! The weights of a fit.

/// How a fit weighs its terms. The defaults were chosen on synthetic validation frames.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Standard deviation of the network's registration, pixels of the canonical image: scale of the robust reprojection term.
    pub registration_deviation_px: f64,
    /// Standard deviation of the network's depth, as a fraction of the depth.
    pub depth_deviation: f64,
    /// How many independent measurements the depths of a frame are worth: their errors go together.
    pub independent_depths: f64,
    /// How many independent measurements the registrations of a frame are worth beside the image.
    pub independent_registrations: f64,
    /// The same before the image is compared. Much more, because only the network then says where a folded part is, and
    /// bending resists the fold. The image can only pull in what is a few pixels off.
    pub continuation_registrations: f64,
    /// Weight of isometry.
    pub isometry: f64,
    /// Weight of bending.
    pub bending: f64,
    /// Weight of rigidity, of a template that is no sheet.
    pub rigidity: f64,
    /// How many independent measurements the photo-consistency points of a frame are worth.
    pub photo_consistency: f64,
    /// Scale of the robust photo-consistency term, local deviations.
    pub photo_consistency_scale: f64,
    /// Blur of image and drawing, pixels of the canonical image, one entry per round.
    pub blurs: Vec<f32>,
    /// Accepted solver steps per round.
    pub steps: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            registration_deviation_px: 2.0,
            depth_deviation: 0.03,
            independent_depths: 2.0,
            independent_registrations: 10.0,
            continuation_registrations: 100.0,
            isometry: 1e4,
            bending: 1.0,
            rigidity: 30.0,
            photo_consistency: 2000.0,
            photo_consistency_scale: 0.8,
            blurs: vec![3.0, 1.2, 0.7],
            steps: 8,
        }
    }
}
