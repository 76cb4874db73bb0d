//! One file for each kind of file that is read.

pub(crate) mod bundle;
pub(crate) mod checkpoint;
pub(crate) mod gltf;
pub(crate) mod obj;
pub(crate) mod picture;
pub(crate) mod planted;
pub(crate) mod recording;
pub(crate) mod shard;
pub(crate) mod template;
pub(crate) mod weights;
pub(crate) mod y4m;
