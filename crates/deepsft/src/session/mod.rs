//! Video: targets followed from frame to frame, with finders beside the trackers.
//!
//! A [`Session`] decides which view of the camera a frame is looked at in, who is searched for when, what is found and lost, and when
//! the moving meshes are asked for the camera. Its trackers decide on their tracks. It does no work of finders and knows no files, clocks or threads:
//! frames go in with their time, meshes come out, and questions for the finders, whose answers go in. A [`VideoFollower`] answers them in
//! place; a page posts them to another worker.
//!
//! # Found, lost, confirmed, dropped
//!
//! Times are seconds of the video. What is not said here is a setting of [tracking](deepsft_geometry::tracking).
//!
//! | event | when | where |
//! |---|---|---|
//! | a frame confirms the mesh | correlation of the print from 0.35 on; from 0.5 on after a search until finders confirm it | `Tracker` |
//! | the mesh is held | the newest frame does not confirm it | `Tracker` |
//! | a sighting by matches counts | after a fit, from a correlation of 0.5 on; of a print that is similar to itself only if it is found | `TargetFinder::find` |
//! | a track jumps | a frame does not confirm the mesh, and the print shifted over the image correlates more elsewhere: a search | `Tracker` |
//! | a track starts, or starts again | an answer of the finders leads to a correlation of 0.5, and of more than the track has | `Tracker::update` |
//! | a track is confirmed | an answer is near it, or the image confirms it more | `Tracker::update` |
//! | a track is dropped | a network sees nothing, and the image confirms less than 0.5, or the track comes from a search. Features never drop one | `Tracker::update` |
//! | a track ends | no confirmed frame for 0.09 s and in two frames; at once where it leaves the view. Finders look for it from then on | `Tracker` |
//! | a target is found | three frames in a row confirm its mesh, or one from 0.8 on | `presence.rs` |
//! | a target is lost | no frame has confirmed its mesh for 0.4 s, or the video starts afresh | `presence.rs` |
//! | a target gives way | in one place of a frame the image confirms more of another target: its sighting does not count, its track ends | `TargetFinder::tell_apart`, `Session::settle` |
//! | a sighting is for a copy | of a print that is looked for more than once: for the followed one near it, else for one that is missing | `Session::add_copy` |
//! | finders confirm a followed target | after 2 s by the caller's clock; at once below 0.6; with a network whenever nothing is missing | `search_plan.rs` |

mod exchange;
mod focal_search;
mod followed_target;
mod presence;
mod search_plan;
mod video_follower;
mod video_session;
mod view_choice;

pub use exchange::{Answer, Effect, Followed, FollowedFrame, Next, Question, SessionOptions, Source, TargetId};
pub use video_follower::{Detection, FrameTimes, TrackedFrame, VideoFollower, VideoOptions};
pub use video_session::Session;
