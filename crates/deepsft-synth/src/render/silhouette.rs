//! Where an object of any shape can be held: its outermost vertices in the image.

use deepsft_geometry::Camera;
use deepsft_geometry::glam::{DVec2, DVec3};

/// The vertices (mm, camera frame) on the convex hull of their projections, in order around it (monotone chain, Andrew
/// 1979). Vertices behind the camera do not count.
pub(crate) fn silhouette(vertices_camera: &[DVec3], camera: &Camera) -> Vec<usize> {
    let mut points: Vec<(DVec2, usize)> = vertices_camera
        .iter()
        .enumerate()
        .filter_map(|(vertex, p)| Some((camera.project(*p)?, vertex)))
        .collect();
    points.sort_unstable_by(|(a, i), (b, j)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(i.cmp(j)));
    let chain = |points: &mut dyn Iterator<Item = (DVec2, usize)>| {
        let mut chain: Vec<(DVec2, usize)> = Vec::new();
        for (p, vertex) in points {
            while let [.., (a, _), (b, _)] = chain[..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push((p, vertex));
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull.into_iter().map(|(_, vertex)| vertex).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::training_camera;

    #[test]
    fn the_corners_of_a_square_are_its_outline_in_order_and_what_is_within_is_not() {
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let points = [
            p(0.0, 0.0, 500.0),
            p(-50.0, -50.0, 500.0),
            p(50.0, 50.0, 500.0),
            p(10.0, 5.0, -500.0),
            p(50.0, -50.0, 500.0),
            p(-50.0, 50.0, 500.0),
            // Halfway on a side.
            p(0.0, 50.0, 500.0),
        ];
        let outline = silhouette(&points, &training_camera());
        assert_eq!(outline, [1, 4, 2, 5]);
        assert!(silhouette(&[], &training_camera()).is_empty());
    }
}
