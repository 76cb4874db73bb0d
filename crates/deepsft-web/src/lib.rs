//! The wasm-bindgen surface of DeepSfT, and nothing else: an [`Engine`] that takes a model's files and
//! RGBA frames from JavaScript and gives maps back. The JavaScript package in `www/` wraps it; people use
//! that.
//!
//! Everything that can fail rejects with a JavaScript `Error` that carries a stable `code` and a sentence
//! (`failure`), also when Rust panics (`settle`).
//!
//! The crate is empty in a native build.
#![cfg(target_family = "wasm")]

mod adapter;
mod clock;
mod engine;
mod estimate;
mod failure;
mod settle;

pub use engine::Engine;
pub use estimate::RawEstimate;
