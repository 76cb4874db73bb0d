//! What the tracker reports: of a frame, and of the network's maps.

use glam::DVec3;

/// The object in the newest frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Tracked {
    /// Number of the frame.
    pub frame: u64,
    /// Whether the object is followed. Stays so through a few missed frames, in which the mesh stands still.
    pub found: bool,
    /// Whether the frame does not confirm the mesh, which then stands where it was.
    pub held: bool,
    /// The mesh's vertices, camera frame, mm; empty unless found.
    pub vertices_camera: Vec<DVec3>,
    /// How well the image confirms the mesh around each vertex, 0 to 1: the correlation of the normalised image with the
    /// normalised print there. 0 where the print is not seen or has no contrast; empty unless found.
    pub confidence: Vec<f32>,
    /// The same for the whole visible print.
    pub correlation: f64,
    /// Solver steps that the frame took.
    pub iterations: usize,
}

/// What the network's maps did to the track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrackUpdate {
    /// There was no track, now there is.
    Started,
    /// Network and track agree, or the image confirms the track more than the maps.
    Confirmed,
    /// They disagreed, and the image confirms the maps more: the track starts again from them.
    Restarted,
    /// The network does not see the object, and the image does not confirm the track or the track comes from a search: it
    /// is lost.
    Dropped,
    /// The maps changed nothing: their frame is forgotten, or they show too little to start from.
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
