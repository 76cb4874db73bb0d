//! One file a command.

pub mod bench;
pub mod bundle;
pub mod clip;
pub mod completion;
pub mod eval;
pub mod network;
pub mod poster;
pub mod reconstruct;
pub mod recording;
pub mod study;
pub mod synth;
pub mod template;
pub mod track;
pub mod train;
