//! `deepsft camera import`: a camera as another program wrote it.

use anyhow::Result;
use clap::Args;
use deepsft_formats::{camera_to_json, read_camera, write_file};
use deepsft_geometry::Lens;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
What is read: OpenCV (YAML, XML, JSON), ROS camera_info, Kalibr, COLMAP cameras.txt, ORB-SLAM, RealSense, Open3D and ARKit as JSON.
Lenses with 4, 5, 8, 12 or 14 of OpenCV's coefficients, and OpenCV's fisheye (equidistant). More than five coefficients are replaced by
the five that are nearest. All but COLMAP have the centre of the first pixel at (0, 0): half a pixel is added to cx and cy.

Every --camera reads these files as they are; the import shows what is read of them.

Example:
  deepsft camera import head_camera.yaml --out camera.json")]
pub struct ImportArguments {
    /// The camera file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Camera file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub fn run(arguments: &ImportArguments) -> Result<()> {
    let camera = read_camera(&arguments.file)?;
    write_file(&arguments.out, camera_to_json(&camera).as_bytes())?;
    let ([fx, fy], [cx, cy]) = (camera.focal().to_array(), camera.principal_point().to_array());
    let lens = match camera.lens() {
        Lens::Pinhole => "no distortion".to_owned(),
        Lens::Polynomial(coefficients) => format!("k1, k2, p1, p2, k3 {coefficients:.5?}"),
        Lens::Fisheye(coefficients) => format!("fisheye k1, k2, k3, k4 {coefficients:.5?}"),
    };
    let (out, size) = (arguments.out.display(), camera.size());
    println!(
        "{out}: {size} pixels, focal length {fx:.2}, {fy:.2}, principal point {cx:.2}, {cy:.2} from the corner, {lens}"
    );
    Ok(())
}
