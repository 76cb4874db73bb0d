//! The browser's clock: the one place of the project's wasm that reads time.

use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Milliseconds since some origin.
    #[wasm_bindgen(js_namespace = performance, js_name = now)]
    pub fn now_ms() -> f64;
}

/// Seconds since some origin.
pub fn now_s() -> f64 {
    now_ms() / 1000.0
}

/// Measures the stages of one frame.
pub struct Stopwatch {
    lap_began_ms: f64,
}

impl Stopwatch {
    /// Starts the first lap.
    pub fn start() -> Self {
        Self { lap_began_ms: now_ms() }
    }

    /// Milliseconds since the last lap, or the start.
    pub fn lap_ms(&mut self) -> f64 {
        let now_ms = now_ms();
        now_ms - std::mem::replace(&mut self.lap_began_ms, now_ms)
    }
}
