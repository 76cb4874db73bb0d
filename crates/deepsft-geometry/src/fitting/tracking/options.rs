//! The settings of tracking.

use crate::fitting::options::FitOptions;

/// Weight of rigidity: less than in one image, where it holds what is not seen. Of 464 frames of four clips in which a soft toy bends and turns
/// 76 % were within 2 pixels with 30, 88 % with 5.
const RIGIDITY: f64 = 5.0;

/// How a video is followed. The defaults were chosen on synthetic clips.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingOptions {
    /// Weights of the fit, and the rounds of the fit that starts a track.
    pub fit: FitOptions,
    /// Blur of image and drawing, pixels of the canonical image, one entry per round of a frame that is followed. Rounds before the last that blur by 3 pixels
    /// or more look at the image at half the size.
    pub blurs: Vec<f32>,
    /// Steps of a rigid motion in the first round of a frame that is followed.
    pub rigid_steps: usize,
    /// Accepted solver steps in the last round of a frame that is followed; each round before it has one, in the
    /// second try two.
    pub steps: usize,
    /// Blurs of the second try, when the first does not find the sheet again.
    pub wide_blurs: Vec<f32>,
    /// Fraction of the last motion that is expected to go on, 0 to 1.
    pub persistence: f64,
    /// Correlation ([`Verdict::correlation`](crate::Verdict::correlation)) that a track must have to start.
    pub start_correlation: f64,
    /// Correlation below which a frame counts as missed. After a search, until a finder's next answer, it is
    /// `start_correlation` instead.
    pub min_correlation: f64,
    /// Seconds of the video without a confirmed frame after which the track is lost, if at least two frames in a row were missed.
    pub patience_s: f64,
    /// Visible photo-consistency points (one stands for 9 pixels of the canonical image) below which the object is out of view and the track lost.
    pub min_points: usize,
    /// Distance, pixels of the canonical image, between finder and track above which they disagree, where a fifth of the sheet is further apart.
    /// Default 5: the network is seldom so far off, and comparing both with the image costs no more than a start.
    pub disagreement_px: f64,
    /// Frames kept for the finders' answers, which come late.
    pub memory: usize,
}

impl Default for TrackingOptions {
    fn default() -> Self {
        Self {
            fit: FitOptions {
                rigidity: RIGIDITY,
                ..FitOptions::default()
            },
            blurs: vec![3.0, 0.8],
            rigid_steps: 10,
            steps: 3,
            wide_blurs: vec![7.0, 3.0, 0.8],
            persistence: 0.8,
            start_correlation: 0.5,
            min_correlation: 0.35,
            patience_s: 0.09,
            min_points: 100,
            disagreement_px: 5.0,
            memory: 32,
        }
    }
}
