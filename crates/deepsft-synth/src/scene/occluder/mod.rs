//! What hides parts of the template: hands, things, discs, and an arm that passes.

mod anchored;
mod body;
mod hand;
mod passing_arm;
mod sampling;

pub use anchored::OccluderKind;
pub(crate) use anchored::{Held, Occluder};
pub(crate) use body::Placed;
pub(crate) use passing_arm::PassingArm;
pub(crate) use sampling::sample_occluders;
