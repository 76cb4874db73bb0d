//! The public pieces of the crate, one by one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod alignment;
mod capsule;
mod control_points;
mod deformation;
mod depth_camera;
mod in_order;
mod motion;
mod paper_protocol;
mod pose;
mod print_response;
mod projected_mesh;
mod random;
mod sensor;
mod unfinished;
mod value_noise;
