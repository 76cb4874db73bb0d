//! Camera files, ours and those of other programs.

use anyhow::Result;
use deepsft_formats::{camera_from_foreign, camera_from_json, camera_to_json};
use deepsft_geometry::glam::DVec3;

pub(crate) fn read(input: &[u8]) -> Result<()> {
    let camera = camera_from_json(input).or_else(|_| camera_from_foreign(input))?;
    // The last digit of a number may be another.
    let again = camera_from_json(camera_to_json(&camera).as_bytes());
    let is_same = again.is_ok_and(|again| {
        again.size() == camera.size()
            && again
                .focal()
                .abs_diff_eq(camera.focal(), 1e-9 * camera.focal().max_element())
    });
    assert!(is_same, "written and read again it is another camera");
    if let Some(pixel) = camera.project(DVec3::new(0.1, -0.2, 1.0)) {
        assert!(!pixel.is_nan(), "a ray has no pixel");
    }
    Ok(())
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let seeds = [
        r#"{"width": 4, "height": 3, "fx": 4.0, "fy": 4.0, "cx": 2.0, "cy": 1.5, "distortion": [0.1, 0, 0, 0]}"#,
        "image_width: 4\nimage_height: 3\ndistortion_model: rational_polynomial\ncamera_matrix: {data: [4, 0, 2, 0, 4, 1, 0, 0, 1]}\nD: [0, 0, 0, 0, 0, 0.1, 0, 0]\n",
        "%YAML:1.0\nK: !!opencv-matrix\n  data: [4, 0, 2, 0, 4, 1, 0, 0, 1]\nsize: [4, 3]\n",
        "<a><image_Width>4</image_Width><h>3</h><K><data>4 0 2 0 4 1 0 0 1</data></K></a>",
        "# cameras\n1 OPENCV_FISHEYE 4 3 4 4 2 1.5 0.1 0 0 0\n",
    ];
    Ok(seeds.map(|seed| seed.as_bytes().to_vec()).into())
}
