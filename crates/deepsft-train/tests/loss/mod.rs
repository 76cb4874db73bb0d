//! The losses by hand and their gradients. They are tests of what is private: [`crate::loss`] includes them.

mod bilinear_warp;
mod depth_loss;
mod gradients;
mod photo_consistency_loss;
mod supervised_maps_loss;
mod total_variation;
