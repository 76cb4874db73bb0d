//! The wasm-bindgen surface of DeepSfT, and nothing else: an [`Engine`] that takes a model's files, pictures
//! and RGBA frames from JavaScript and gives maps and meshes back, and a [`MeshTracker`] that follows meshes
//! through a video, in an instance of its own. The JavaScript package in `www/` wraps them; people use that.
//!
//! Everything that can fail rejects with a JavaScript `Error` that carries a stable `code` and a sentence
//! (`failure`), also when Rust panics (`settle`).
//!
//! The crate is empty in a native build.
#![cfg(target_family = "wasm")]
#![allow(missing_debug_implementations, reason = "JavaScript sees the types, and prints none")]

mod clock;
mod engine;
mod estimate;
mod failure;
mod input;
mod mesh;
mod object;
mod scan;
mod settle;
mod target;
mod target_template;
mod tracker;

pub use engine::Engine;
pub use scan::read_scan;
pub use target_template::TargetTemplate;
pub use tracker::MeshTracker;

use wasm_bindgen::prelude::*;

/// Runs the static constructors of whatever dependency has some, once, when the module is instantiated.
///
/// A module that has such constructors and never calls them is taken for a program by the linker,
/// which then runs all of them at the top of *every* call from JavaScript: a tenth of a millisecond for
/// each getter and callback.
#[wasm_bindgen(start)]
#[expect(unsafe_code, reason = "the linker's own function; there is no safe name for it")]
pub fn start() {
    unsafe extern "C" {
        fn __wasm_call_ctors();
    }
    // SAFETY: the linker defines it in every module, without parameters or result. wasm-bindgen runs this
    // function once an instance, before anything else.
    unsafe { __wasm_call_ctors() }
}
