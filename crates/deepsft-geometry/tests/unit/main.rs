//! One module for each file of the crate whose public items it tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/printed_box.rs"]
mod printed_box;

mod canonical;
mod canonical_views;
mod color_response;
mod contrast_normalization;
mod disjoint_sets;
mod islands;
mod lens;
mod measurements;
mod metrics;
mod mipmap;
mod one_euro;
mod photo_consistency;
mod pinhole;
mod rest_surface;
mod rigid_motion;
mod self_calibration;
mod surface_locator;
mod template;
mod topology;
mod unrolling;
mod visible_surface;
mod welding;
