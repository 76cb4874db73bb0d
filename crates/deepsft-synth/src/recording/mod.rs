//! RGB-D recordings: what training steps 2 and 3 learn from.

pub(crate) mod alignment;
pub(crate) mod depth_camera;
mod frame_files;
mod import;
mod pairing;
mod print_response;
mod reader;
mod sensor;
mod simulator;
mod truth_files;

pub use frame_files::FramePairing;
pub use import::{RecordingImport, RecordingSource, TruthSource};
pub use pairing::{DEPTH_FOLDER, MASK_FOLDER, RGB_FOLDER};
pub use print_response::PrintResponse;
pub use reader::{RecordedFrame, Recording};
pub use sensor::RgbdSensor;
pub use simulator::{RecordingSimulator, SimulatedFrame, Take};
