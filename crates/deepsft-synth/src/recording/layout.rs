//! Names of the files and folders of a recording.

/// Name of the file that tells which pictures belong together.
pub const ASSOCIATIONS_FILE: &str = "associations.txt";
/// Name of the folder with the colour pictures.
pub const RGB_FOLDER: &str = "rgb";
/// Name of the folder with the depth pictures.
pub const DEPTH_FOLDER: &str = "depth";
/// Name of the folder with the object's masks.
pub const MASK_FOLDER: &str = "mask";
