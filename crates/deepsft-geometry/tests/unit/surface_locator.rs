//! Texture positions and the faces under them.

use deepsft_geometry::fitting::SurfaceLocator;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Picture, Template};

#[test]
fn every_position_of_a_sheet_is_found_and_leads_back() {
    let template = Template::thin_shell(Picture::from_fn(1, 1, |_, _| [0; 3]), 297.0, 210.0).unwrap();
    let mesh = template.mesh();
    let locator = SurfaceLocator::new(mesh);
    for i in 0..=100 {
        for j in 0..=100 {
            let uv = DVec2::new(f64::from(i) / 100.0, f64::from(j) / 100.0);
            let point = locator.locate(uv).unwrap();
            let back: DVec2 = (mesh.faces()[point.face].iter().zip(point.barycentric))
                .map(|(&v, w)| w * mesh.texture_coordinates()[v])
                .sum();
            assert!(back.distance(uv) < 1e-9);
        }
    }
    assert_eq!(locator.locate(DVec2::new(1.1, 0.5)), None);
    assert_eq!(locator.locate(DVec2::NAN), None);
}
