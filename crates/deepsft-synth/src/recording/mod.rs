//! RGB-D recordings: what training steps 2 and 3 learn from.

mod alignment;
mod depth_camera;
mod layout;
mod pairing;
mod print_response;
mod reader;
mod sensor;
mod simulator;

pub use alignment::DepthAlignment;
pub use depth_camera::{DepthNoise, SeenDepth};
pub use layout::{ASSOCIATIONS_FILE, DEPTH_FOLDER, MASK_FOLDER, RGB_FOLDER};
pub use print_response::PrintResponse;
pub use reader::{RecordedFrame, Recording};
pub use sensor::RgbdSensor;
pub use simulator::{RecordingSimulator, SimulatedFrame, SimulationConfig, Take};
