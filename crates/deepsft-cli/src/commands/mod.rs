//! One file a command.

pub mod bundle;
pub mod camera;
pub mod clip;
pub mod eval;
pub mod network;
pub mod reconstruct;
pub mod recording;
pub mod synth;
pub mod template;
pub mod track;
pub mod train;
