//! The second pose of a solid of which one side is seen.

use crate::mesh::{RigidMotion, TriangleMesh};
use glam::DVec3;

/// A side is what faces one way: the power of the cosine that a face counts with, and the steps that look for the way.
const SIDE: i32 = 8;
const SIDE_STEPS: usize = 8;

/// Steps of orthogonal iteration, few: in the end it comes back to where the mesh was.
const POSE_STEPS: usize = 20;

/// Where the solid `mesh` looks almost as it does at `vertices` (camera frame, mm): the side that the image confirms most is tilted the other
/// way, as weak perspective allows it (Schweighofer and Pinz 2006). `None` where the image confirms nothing.
pub(super) fn reversed_pose(mesh: &TriangleMesh, vertices: &[DVec3], confidence: &[f32]) -> Option<Vec<DVec3>> {
    let rest = mesh.vertices();
    // The faces that are seen, each with twice its area times how far it is confirmed, along its normal.
    let seen = mesh.faces().iter().filter_map(|&face| {
        let [a, b, c] = face.map(|v| rest[v]);
        let confirmed = face.iter().map(|&v| f64::from(confidence[v])).sum::<f64>() / 3.0;
        (confirmed > 0.0).then(|| (face, confirmed * (b - a).cross(c - a)))
    });
    let seen: Vec<_> = seen.collect();
    let share = |n: DVec3, way: DVec3| n.normalize_or_zero().dot(way).max(0.0).powi(SIDE);
    let mut way = seen.iter().map(|(_, n)| *n).sum::<DVec3>().normalize_or_zero();
    for _ in 0..SIDE_STEPS {
        let facing = seen.iter().map(|(_, n)| share(*n, way) * *n);
        way = facing.sum::<DVec3>().normalize_or_zero();
    }
    let mut weights = vec![0.0; rest.len()];
    for (face, n) in &seen {
        face.iter().for_each(|&v| weights[v] += share(*n, way) * n.length());
    }
    let told = rest.iter().zip(vertices).zip(weights);
    let side: Vec<_> = told
        .filter(|(_, weight)| *weight > 0.0)
        .map(|((p, q), weight)| (*p, *q, weight))
        .collect();
    let total: f64 = side.iter().map(|(.., weight)| weight).sum();
    let depth = side.iter().map(|(_, q, weight)| weight * q.z).sum::<f64>() / total;
    let reversed = side
        .iter()
        .map(|&(p, q, weight)| (p, q * (depth / q.z).powi(2), weight));
    let mut pose = RigidMotion::align(reversed, RigidMotion::IDENTITY);
    for _ in 0..POSE_STEPS {
        pose = pose.towards_rays(side.iter().copied());
    }
    (total > 0.0).then(|| rest.iter().map(|&p| pose.apply(p)).collect())
}
