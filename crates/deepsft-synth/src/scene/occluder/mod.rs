//! What hides parts of the template: hands, things, discs, and an arm that passes.

mod anchored;
mod body;
mod hand;
mod passing_arm;
mod sampling;

pub use anchored::OccluderKind;
pub(crate) use anchored::{Occluder, SheetInImage};
pub(crate) use body::{ImageOccluder, covered_by};
pub(crate) use passing_arm::PassingArm;
pub(crate) use sampling::sample_occluders;
