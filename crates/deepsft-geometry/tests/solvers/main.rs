//! Solver, completion, fit and tracker on shapes and videos whose answer is known.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/printed_box.rs"]
mod printed_box;

mod arap_completion;
mod close_ups;
mod fitting;
mod flat_print;
mod maps_completion;
mod mesh_solver;
mod seams;
mod shapes;
mod sheet;
mod solid_fit;
mod terms;
mod tracking;
