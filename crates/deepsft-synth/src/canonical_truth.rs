//! The truth of a sample in the image of the canonical camera.

use crate::sample::Sample;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, CanonicalWarp, Maps, TriangleMesh};

/// Renders the exact maps of `sample` in the image of `canonical`, a camera that stands where the sample's own does. `mesh` is
/// the mesh of its template. They leave out what the sample's own mask leaves out.
pub fn canonical_truth(sample: &Sample, mesh: &TriangleMesh, canonical: &Camera) -> Maps {
    let mut maps = VisibleSurface::new(mesh, &sample.vertices_camera, canonical).maps();
    let warp = CanonicalWarp::new(&sample.camera, canonical);
    let (own, width) = (&sample.truth, maps.size().width);
    for pixel in 0..maps.depth().len() {
        let centre = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let inside = |at: DVec2| {
            at.cmpge(DVec2::ZERO).all() && at.x < own.size().width as f64 && at.y < own.size().height as f64
        };
        let at = warp.source_from_canonical(centre).filter(|at| inside(*at));
        if !at.is_some_and(|at| own.inside(at.y as usize * own.size().width + at.x as usize)) {
            maps.clear(pixel);
        }
    }
    maps
}
