//! The capsule, an object with a volume.

#[path = "../common/capsule.rs"]
mod fixture;

use deepsft_geometry::Welding;
use deepsft_geometry::glam::DVec3;
pub(crate) use fixture::capsule;

#[test]
fn a_welded_capsule_is_closed_of_genus_0_and_looks_outwards() {
    let mesh = capsule(240.0, 30.0, 21, 16);
    assert_eq!(mesh.faces().len(), 2 * 16 * 19);
    let welding = Welding::of(&mesh).unwrap();
    let welded = welding.mesh();
    // Two poles and 19 rings of 16.
    assert_eq!(welded.vertices().len(), 2 + 19 * 16);
    let euler = welded.vertices().len() as i64 - welded.edges().len() as i64 + welded.faces().len() as i64;
    assert_eq!(euler, 2);
    let v = welded.vertices();
    for &[a, b, c] in welded.faces() {
        let normal = (v[b] - v[a]).cross(v[c] - v[a]);
        let centre = (v[a] + v[b] + v[c]) / 3.0;
        let from_axis = centre - DVec3::new(centre.x.clamp(-90.0, 90.0), 0.0, 0.0);
        assert!(normal.dot(from_axis) > 0.0);
    }
    // In the texture no face is folded over and both charts turn the same way.
    let uv = mesh.texture_coordinates();
    let areas = mesh
        .faces()
        .iter()
        .map(|&[a, b, c]| (uv[b] - uv[a]).perp_dot(uv[c] - uv[a]));
    assert!(areas.clone().all(|area| area < 0.0) || areas.clone().all(|area| area > 0.0));
}
