//! Solver, completion, fit and tracker on shapes and videos whose answer is known.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod arap_completion;
mod fitting;
mod maps_completion;
mod mesh_solver;
mod seams;
mod shapes;
mod sheet;
mod terms;
mod tracking;
