//! From maps to visible vertices and the whole mesh.

use crate::shapes::{bent, rmse, sheet};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{
    Camera, CompletionOptions, GeometryError, Maps, MapsCompletion, TriangleMesh, VisibleVertices, training_camera,
};

/// A bent sheet before the training camera, and its exact maps.
fn view() -> (TriangleMesh, Vec<DVec3>, Maps, Camera) {
    let (mesh, camera) = (sheet(), training_camera());
    let truth = bent(&mesh, |s| 1.2 * s);
    let maps = VisibleSurface::new(&mesh, &truth, &camera).maps();
    (mesh, truth, maps, camera)
}

/// Clears the pixels that `covered` names by column and row.
fn cover(maps: &mut Maps, covered: impl Fn(usize, usize) -> bool) {
    for pixel in 0..maps.depth().len() {
        if covered(pixel % maps.size().width, pixel / maps.size().width) {
            maps.clear(pixel);
        }
    }
}

#[test]
fn all_vertices_of_a_sheet_in_view_are_found_within_a_tenth_of_a_millimetre() {
    let (mesh, truth, maps, camera) = view();
    let found = VisibleVertices::new(&mesh, 0).find(&maps, &camera).unwrap();
    assert_eq!(found.len(), truth.len());
    for (vertex, point) in found.iter().enumerate() {
        assert_eq!((point.vertex, point.weight), (vertex, 1.0));
        // Between pixels 1.3 mm apart a face is flat; a vertex is a kink of some degrees between faces.
        assert!(point.p_camera.distance(truth[vertex]) < 0.1, "{vertex}");
    }
}

#[test]
fn what_an_occluder_covers_is_not_found_and_the_margin_keeps_away_from_it() {
    let (mesh, truth, mut maps, camera) = view();
    cover(&mut maps, |x, _| x >= 240);
    let column = |vertex: usize| camera.project(truth[vertex]).unwrap().x;
    for (margin, last) in [(0, 243.0), (5, 238.0)] {
        let found = VisibleVertices::new(&mesh, margin).find(&maps, &camera).unwrap();
        assert!(found.iter().all(|p| column(p.vertex) <= last), "margin {margin}");
        if margin == 0 {
            let before = (0..truth.len()).filter(|&v| column(v) < 239.0).count();
            assert!(found.len() >= before && before > 100);
        }
    }
}

#[test]
fn a_break_of_the_maps_gives_no_vertex_between_its_sides() {
    let (mesh, truth, mut maps, camera) = view();
    // The right half of the image is shifted to half the depth: another sheet before this one, say.
    for pixel in 0..maps.depth().len() {
        if pixel % maps.size().width >= 240 && maps.inside(pixel) {
            maps.set(pixel, 0.5 * maps.depth()[pixel], maps.registration()[pixel]);
        }
    }
    let found = VisibleVertices::new(&mesh, 0).find(&maps, &camera).unwrap();
    for point in &found {
        let depth = point.p_camera.z / truth[point.vertex].z;
        assert!((depth - 1.0).abs() < 0.01 || (depth - 0.5).abs() < 0.01, "{depth}");
    }
}

#[test]
fn holes_that_are_not_numbers_and_the_back_of_a_sheet_show_nothing() {
    let (mesh, truth, maps, camera) = view();
    let visible = VisibleVertices::new(&mesh, 0);
    for (depth, u) in [
        (f32::NAN, 0.5),
        (f32::INFINITY, 0.5),
        (0.0, 0.5),
        (500.0, f32::NAN),
        (500.0, f32::INFINITY),
    ] {
        let mut broken = maps.clone();
        for row in 0..maps.size().height {
            for column in 0..240 {
                broken.set(row * maps.size().width + column, depth, [u, 0.5]);
            }
        }
        let found = visible.find(&broken, &camera).unwrap();
        assert!(!found.is_empty() && found.iter().all(|p| p.p_camera.is_finite()));
        assert!(found.iter().all(|p| camera.project(truth[p.vertex]).unwrap().x > 239.0));
    }
    let mut mirrored = maps.clone();
    for row in 0..maps.size().height {
        for column in 0..maps.size().width {
            let from = row * maps.size().width + maps.size().width - 1 - column;
            mirrored.set(
                row * maps.size().width + column,
                maps.depth()[from],
                maps.registration()[from],
            );
        }
    }
    assert_eq!(visible.find(&mirrored, &camera).unwrap(), []);
    assert_eq!(visible.find(&Maps::empty((480, 270)), &camera).unwrap(), []);
    assert!(matches!(
        visible.find(&Maps::empty((270, 480)), &camera),
        Err(GeometryError::MapSize { .. })
    ));
}

#[test]
fn a_mesh_is_completed_from_maps_and_its_maps_stay_in_the_mask() {
    let (mesh, truth, exact, camera) = view();
    let mut seen = exact.clone();
    let disc = |x: f64, y: f64| (x - 255.0).hypot(y - 127.0) < 50.0;
    cover(&mut seen, |x, y| disc(x as f64 + 0.5, y as f64 + 0.5));
    let mut completion = MapsCompletion::new(&mesh, CompletionOptions::default()).unwrap();
    let completed = completion.complete(&seen, &camera).unwrap().unwrap();
    let hidden = |i: usize| camera.project(truth[i]).is_some_and(|p| disc(p.x, p.y));
    assert!((0..truth.len()).filter(|&i| hidden(i)).count() > truth.len() / 6);
    // The paper's weights let the visible part give way by some tenths; see also the tests of completion.
    assert!(rmse(&completed.vertices_camera, &truth, |i| !hidden(i)) < 1.0);
    assert!(rmse(&completed.vertices_camera, &truth, hidden) < 1.0);
    let maps = completed.maps(&mesh).within(&seen);
    assert_eq!(maps.mask(), seen.mask());
    let inside: Vec<usize> = (0..seen.depth().len()).filter(|&p| seen.inside(p)).collect();
    let change = |&p: &usize| (maps.depth()[p] - seen.depth()[p]).abs();
    assert!(inside.iter().map(change).sum::<f32>() / (inside.len() as f32) < 1.0);
    assert_ne!(maps, seen, "they are drawn from the mesh");
}

#[test]
fn maps_that_show_less_than_a_patch_are_not_completed() {
    let (mesh, _, mut maps, camera) = view();
    let mut completion = MapsCompletion::new(&mesh, CompletionOptions::default()).unwrap();
    cover(&mut maps, |x, y| !((230..240).contains(&x) && (130..140).contains(&y)));
    assert!(maps.area() > 0);
    assert!(completion.complete(&maps, &camera).unwrap().is_none());
    let nothing = Maps::empty((480, 270));
    assert!(completion.complete(&nothing, &camera).unwrap().is_none());
}
