//! Tracking in video: the mesh of the last frame, predicted, is the start of the next.
//!
//! [`Tracker`] follows one template at camera rate with one or two photo-consistency rounds per frame; the network runs beside it
//! at whatever rate the device allows, starts the track, confirms it and starts it again when it is lost. A network's
//! answer may come frames late: the tracker keeps the last frames and catches up. [`OneEuro`] smooths the result if
//! that is wanted.

mod one_euro;
mod search;
mod settings;
mod tracked;
mod tracker;
mod tracker_image;

pub use one_euro::{OneEuro, OneEuroOptions};
pub use settings::{MEMORY, START_CORRELATION};
pub use tracked::{TrackUpdate, Tracked};
pub use tracker::Tracker;
pub use tracker_image::TrackerImage;
