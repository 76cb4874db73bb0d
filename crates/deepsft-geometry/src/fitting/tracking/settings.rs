//! The settings of tracking, chosen on synthetic clips.

/// Weight of rigidity: less than in one image, where it holds what is not seen. Of 464 frames of four clips in which a soft toy bends and turns
/// 76 % were within 2 pixels with 30, 88 % with 5.
pub(super) const RIGIDITY: f64 = 5.0;

/// Blur of image and drawing, pixels of the canonical image, of each round of a frame that is followed. Rounds before the last that blur by
/// 3 pixels or more look at the image at half the size.
pub(super) const BLURS_PX: [f32; 2] = [3.0, 0.8];

/// Steps of a rigid motion in the first round of a frame that is followed.
pub(super) const RIGID_STEPS: usize = 10;

/// Accepted solver steps in the last round of a frame that is followed; each round before it has one, in the second try two.
pub(super) const STEPS: usize = 3;

/// Blurs of the second try, when the first does not find the sheet again.
pub(super) const WIDE_BLURS_PX: [f32; 3] = [7.0, 3.0, 0.8];

/// Fraction of the last motion that is expected to go on.
pub(super) const PERSISTENCE: f64 = 0.8;

/// Correlation ([`Verdict::correlation`](crate::Verdict::correlation)) that a track must have to start.
pub const START_CORRELATION: f64 = 0.5;

/// Correlation below which a frame counts as missed. After a search, until a finder's next answer, it is [`START_CORRELATION`] instead.
pub(super) const MIN_CORRELATION: f64 = 0.35;

/// Seconds of the video without a confirmed frame after which the track is lost, if at least two frames in a row were missed.
pub(super) const PATIENCE_S: f64 = 0.09;

/// Visible photo-consistency points (one stands for 9 pixels of the canonical image) below which the object is out of view and the track lost.
pub(super) const MIN_POINTS: usize = 100;

/// Distance, pixels of the canonical image, between finder and track above which they disagree, where a fifth of the sheet is further apart:
/// the network is seldom so far off, and comparing both with the image costs no more than a start.
pub(super) const DISAGREEMENT_PX: f64 = 5.0;

/// Frames that a tracker keeps for the finders' answers, which come late.
pub const MEMORY: usize = 32;

/// Pixels of the canonical image inside the drawn mesh's silhouette that are not compared: a mesh that is a little off would see what lies
/// beside the sheet there, and creep out over it.
pub(super) const MARGIN_PX: usize = 2;

/// How much higher the correlation of a mesh elsewhere must be for the track to go there: of two copies in one light the followed one is kept.
pub(super) const OTHER_COPY: f64 = 0.15;

/// Accepted solver steps of the rounds before the last: they only bring the mesh near.
pub(super) const EARLIER_STEPS: usize = 1;

/// The same where the mesh may be far off: they have to bend it too, on the whole image.
pub(super) const WIDE_STEPS: usize = 2;

/// Blur, pixels of the canonical image, from which rounds look at the image at half the size.
pub(super) const HALVED_BLUR_PX: f32 = 3.0;

/// Missed frames in a row that end a track at the earliest: one alone may be a flash.
pub(super) const MIN_MISSED: usize = 2;
