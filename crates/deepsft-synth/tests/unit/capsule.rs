//! The capsule, an object with a volume.

use deepsft_geometry::Welding;
use deepsft_geometry::glam::DVec3;
use deepsft_synth::capsule;

#[test]
fn a_welded_capsule_is_closed_of_genus_0_and_looks_outwards() {
    let mesh = capsule(240.0, 30.0, 21, 16).unwrap();
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

#[test]
fn capsules_that_cannot_be_are_refused_by_name() {
    for (length, radius, rings, around, named) in [
        (240.0, 30.0, 3, 16, "rings"),
        (240.0, 30.0, 9, 15, "around"),
        (50.0, 30.0, 9, 16, "length"),
        (240.0, f64::NAN, 9, 16, "length"),
    ] {
        let error = capsule(length, radius, rings, around).unwrap_err().to_string();
        assert!(error.contains(named), "{error}");
    }
}
