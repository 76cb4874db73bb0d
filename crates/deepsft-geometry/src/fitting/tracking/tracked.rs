//! What the tracker reports: of a frame, and of a finder's answer.

use crate::surface::Surface;

/// The object in the newest frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Tracked {
    /// Number of the frame.
    pub frame: u64,
    /// The surface while the object is followed. It stays through a few missed frames.
    pub surface: Option<Surface>,
    /// Whether the frame does not confirm the surface, which then stands where it was.
    pub held: bool,
    /// Solver steps that the frame took.
    pub iterations: usize,
}

/// What a finder's answer did to the track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrackUpdate {
    /// There was no track, now there is.
    Started,
    /// Finder and track agree, or the image confirms the track more than the finder's mesh.
    Confirmed,
    /// They disagreed, and the image confirms the finder's mesh more: the track starts again from it.
    Restarted,
    /// The finder does not see the object, and the image does not confirm the track or the track comes from a search: it is lost.
    Dropped,
    /// The answer changed nothing: its frame is forgotten, or it shows too little to start from.
    Ignored,
}

impl TrackUpdate {
    /// `started`, `confirmed`, `restarted`, `dropped` or `ignored`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Confirmed => "confirmed",
            Self::Restarted => "restarted",
            Self::Dropped => "dropped",
            Self::Ignored => "ignored",
        }
    }
}
