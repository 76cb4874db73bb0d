//! Deformations of any mesh by control points: some regions are turned at random, the rest follows as rigidly as possible.

use crate::deform::relaxation::EdgeLengthChange;
use crate::error::SynthError;
use crate::random::{between, unit_direction};
use deepsft_geometry::VertexPoint;
use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{ArapCompletion, CompletionOptions, RigidMotion, TriangleMesh, Welding};
use rand::seq::SliceRandom;
use rand::{Rng, RngExt};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Arc, Mutex, PoisonError};

/// Control points on a mesh. The first lie at the ends of its limbs, the last between them.
const CONTROL_POINTS: usize = 12;

/// Radius of a control point's region, as a fraction of the longest way over the surface.
const REGION_FRACTION: f64 = 0.08;

/// Between which multiples of that radius the ring lies whose middle a control point turns about: the joint above a limb's end.
const JOINT_RING: [f64; 2] = [1.8, 2.6];

/// Turns of a control point on a flat part of the surface, where there is no limb to turn, as a fraction of the others'.
const FLAT_FRACTION: f64 = 0.15;

/// Factor on turns and shifts of a shape that is stretched too much, and how often it is tried.
const WEAKENING: f64 = 0.6;
const WEAKENING_TRIES: usize = 6;

/// Weight of a control point's vertex against the completion's energies: control points give way a little, so that the stretch spreads.
const WEIGHT: f64 = 2.0;

/// Control points that move, at least and at most.
pub(crate) const MOVED: [usize; 2] = [2, 6];

/// Greatest turn of a control point about any axis, degrees, and greatest shift, as a fraction of the longest way over the surface.
const MAX_TURN_DEG: f64 = 55.0;
const MAX_SHIFT: f64 = 0.02;

/// Bounds on the change of edge lengths: a stuffed toy gives at its joints.
pub(crate) const TOY_EDGE_CHANGE: EdgeLengthChange = EdgeLengthChange {
    median: 0.02,
    p95: 0.10,
};

/// A mesh with its control points, ready to be deformed: random parts of the surface are turned about the joint behind them
/// and shifted, and the rest follows as rigidly as possible. (The paper's section 5.1 poses hand-made rigs with random joint
/// angles; control points are our equivalent, which needs no rig.)
#[derive(Clone, Debug)]
pub(crate) struct ControlPointDeformation {
    mesh: TriangleMesh,
    welding: Welding,
    /// Edges of the welded mesh.
    edges: Vec<[usize; 2]>,
    control_points: Vec<ControlPoint>,
    /// The longest way over the surface, mm.
    length: f64,
    /// Solvers that nobody uses at the moment. A solver remembers nothing of the shape before.
    solvers: Arc<Mutex<Vec<ArapCompletion>>>,
}

/// A region of the surface and what it turns about.
#[derive(Clone, Debug)]
struct ControlPoint {
    /// Vertices of the welded mesh.
    vertices: Vec<usize>,
    /// Middle of the ring around the region: within a limb, at its joint.
    joint: DVec3,
    /// 1 at the end of a limb, [`FLAT_FRACTION`] on flat ground.
    turns: f64,
}

/// Which control points move and how, and one that stays where it is.
#[derive(Clone, Debug)]
pub(crate) struct Pulls {
    moved: Vec<Pull>,
    still: Option<usize>,
}

/// How control point `number` moves: a turn about its joint (axis times radians) and a shift, mm.
#[derive(Clone, Copy, Debug)]
struct Pull {
    number: usize,
    turn: DVec3,
    shift: DVec3,
}

impl ControlPointDeformation {
    /// Places control points on `mesh` in its rest shape, each where it is farthest over the surface from those before.
    ///
    /// # Errors
    /// [`SynthError::Geometry`] for a mesh without an edge of positive length.
    pub(crate) fn new(mesh: &TriangleMesh) -> Result<Self, SynthError> {
        let welding = Welding::of(mesh)?;
        let edges = welding.mesh().edges();
        let surface = Surface::new(welding.mesh(), &edges);
        let seeds = surface.farthest_points(CONTROL_POINTS);
        let ways = seeds.iter().flat_map(|&seed| surface.ways(seed));
        let length = ways.filter(|way| way.is_finite()).fold(0.0, f64::max);
        let control_points = seeds
            .iter()
            .map(|&seed| surface.control_point(seed, REGION_FRACTION * length))
            .collect();
        let solver = ArapCompletion::new(mesh, CompletionOptions::default())?;
        Ok(Self {
            mesh: mesh.clone(),
            welding,
            edges,
            control_points,
            length,
            solvers: Arc::new(Mutex::new(vec![solver])),
        })
    }

    /// The vertices of the mesh after a random deformation, mm, template frame, laid on the rest shape as well as a rigid motion
    /// can. One that changes edge lengths by `most` or more is made weaker; what does so at a tenth of its strength keeps the rest
    /// shape.
    pub(crate) fn deform<R: Rng + ?Sized>(&self, most: EdgeLengthChange, rng: &mut R) -> Vec<DVec3> {
        let pulls = self.draw(rng);
        let mut shapes = self.shapes(&pulls, most, [|_| 1.0]);
        shapes.pop().unwrap_or_else(|| self.mesh.vertices().to_vec())
    }

    pub(crate) fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Pulls {
        let mut order: Vec<usize> = (0..self.control_points.len()).collect();
        order.shuffle(rng);
        let [fewest, highest] = MOVED.map(|count| count.min(order.len()));
        let count = rng.random_range(fewest..=highest);
        let still = order.get(count).copied();
        let mut pull = |number| Pull {
            number,
            turn: unit_direction(rng) * between([0.0, MAX_TURN_DEG.to_radians()], rng),
            shift: unit_direction(rng) * between([0.0, MAX_SHIFT * self.length], rng),
        };
        Pulls {
            moved: order.into_iter().take(count).map(&mut pull).collect(),
            still,
        }
    }

    /// The mesh in several shapes, as [`Self::deform`] gives one: in each, the pull that is the `k`-th in `pulls` has the strength of
    /// that shape's function at `k`, -1 to 1. All are made weaker together. None when the weakest stretch too much.
    pub(crate) fn shapes<F: Fn(usize) -> f64>(
        &self,
        pulls: &Pulls,
        most: EdgeLengthChange,
        strengths: impl IntoIterator<Item = F>,
    ) -> Vec<Vec<DVec3>> {
        let strengths: Vec<F> = strengths.into_iter().collect();
        let mut strength = 1.0;
        for _ in 0..WEAKENING_TRIES {
            let pulled = |of_pull: &F| self.pulled(pulls, most, |k| strength * of_pull(k));
            if let Some(shapes) = strengths.iter().map(pulled).collect() {
                return shapes;
            }
            strength *= WEAKENING;
        }
        Vec::new()
    }

    /// The mesh after `pulls`. `None` where that changes edge lengths by more than `most`.
    fn pulled(&self, pulls: &Pulls, most: EdgeLengthChange, strength: impl Fn(usize) -> f64) -> Option<Vec<DVec3>> {
        let rest = self.welding.mesh().vertices();
        let point = |welded: usize, p_camera: DVec3| -> Option<VertexPoint> {
            Some(VertexPoint {
                vertex: self.welding.first(welded)?,
                p_camera,
                weight: WEIGHT,
            })
        };
        let mut points = Vec::new();
        for (k, &Pull { number, turn, shift }) in pulls.moved.iter().enumerate() {
            let ControlPoint { vertices, joint, turns } = &self.control_points[number];
            let turn = DQuat::from_scaled_axis(turn * (strength(k) * turns));
            let place = |p: DVec3| *joint + turn * (p - *joint) + shift * strength(k);
            points.extend(vertices.iter().filter_map(|&vertex| point(vertex, place(rest[vertex]))));
        }
        // One more stays where it is: something to hold on to.
        let still = pulls
            .still
            .iter()
            .flat_map(|&number| &self.control_points[number].vertices);
        points.extend(still.filter_map(|&vertex| point(vertex, rest[vertex])));
        let vertices = self.completed(&points)?;
        let change = EdgeLengthChange::between(rest, &self.edges, &self.welding.weld(&vertices));
        (change.median <= most.median && change.p95 <= most.p95).then(|| {
            let pairs = vertices.iter().zip(self.mesh.vertices());
            let motion = RigidMotion::align(pairs.map(|(&from, &to)| (from, to, 1.0)), RigidMotion::IDENTITY);
            vertices.into_iter().map(|p| motion.apply(p)).collect()
        })
    }

    fn completed(&self, points: &[VertexPoint]) -> Option<Vec<DVec3>> {
        let taken = self.solvers.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut solver = match taken {
            Some(solver) => solver,
            None => ArapCompletion::new(&self.mesh, CompletionOptions::default()).ok()?,
        };
        let completion = solver.complete(points, None);
        self.solvers.lock().unwrap_or_else(PoisonError::into_inner).push(solver);
        completion.ok().map(|completion| completion.vertices)
    }
}

/// A welded mesh as a graph.
struct Surface<'a> {
    mesh: &'a TriangleMesh,
    neighbours: Vec<Vec<(usize, f64)>>,
}

impl<'a> Surface<'a> {
    fn new(mesh: &'a TriangleMesh, edges: &[[usize; 2]]) -> Self {
        let mut neighbours = vec![Vec::new(); mesh.vertices().len()];
        for &[a, b] in edges {
            let length = mesh.vertices()[a].distance(mesh.vertices()[b]);
            neighbours[a].push((b, length));
            neighbours[b].push((a, length));
        }
        Self { mesh, neighbours }
    }

    /// Lengths of the shortest ways along edges from `from` to every vertex (Dijkstra); infinite to other pieces.
    fn ways(&self, from: usize) -> Vec<f64> {
        let mut ways = vec![f64::INFINITY; self.neighbours.len()];
        ways[from] = 0.0;
        // The bits of a positive number are in its order.
        let mut front = BinaryHeap::from([(Reverse(0_u64), from)]);
        while let Some((Reverse(bits), vertex)) = front.pop() {
            let way = f64::from_bits(bits);
            if way > ways[vertex] {
                continue;
            }
            for &(next, length) in &self.neighbours[vertex] {
                if way + length < ways[next] {
                    ways[next] = way + length;
                    front.push((Reverse((way + length).to_bits()), next));
                }
            }
        }
        ways
    }

    /// `count` vertices, each the farthest from those before; the first is the farthest from the vertex nearest to the mean.
    fn farthest_points(&self, count: usize) -> Vec<usize> {
        let vertices = self.mesh.vertices();
        let mean = vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64;
        let squares = |v: &usize| vertices[*v].distance_squared(mean);
        let Some(middle) = (0..vertices.len()).min_by(|a, b| squares(a).total_cmp(&squares(b))) else {
            return Vec::new();
        };
        let mut nearest = self.ways(middle);
        let mut points = Vec::new();
        while points.len() < count.min(vertices.len()) {
            let farthest = (0..nearest.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b]));
            let Some(point) = farthest else { break };
            let ways = self.ways(point);
            // The middle only gave the direction to begin with.
            let first = points.is_empty();
            for (near, way) in nearest.iter_mut().zip(ways) {
                *near = if first { way } else { near.min(way) };
            }
            points.push(point);
        }
        points
    }

    fn control_point(&self, seed: usize, radius: f64) -> ControlPoint {
        let ways = self.ways(seed);
        let within = |[low, high]: [f64; 2]| -> Vec<usize> {
            let ring = |v: &usize| ways[*v] >= low * radius && ways[*v] <= high * radius;
            (0..ways.len()).filter(ring).collect()
        };
        let middle = |of: &[usize]| of.iter().map(|&v| self.mesh.vertices()[v]).sum::<DVec3>() / of.len().max(1) as f64;
        let vertices = within([0.0, 1.0]);
        let ring = within(JOINT_RING);
        if ring.is_empty() {
            return ControlPoint {
                joint: middle(&vertices),
                vertices,
                turns: 1.0,
            };
        }
        let joint = middle(&ring);
        // On flat ground the ring is as wide as the way to it is long; around a limb it is narrower.
        let distances = ring.iter().map(|&v| self.mesh.vertices()[v].distance(joint));
        let reach = distances.sum::<f64>() / ring.len() as f64;
        let width = reach / (radius * (JOINT_RING[0] + JOINT_RING[1]) / 2.0);
        ControlPoint {
            vertices,
            joint,
            turns: (2.5 * (1.0 - width)).clamp(FLAT_FRACTION, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::capsule::capsule;

    #[test]
    fn the_first_control_points_of_a_tube_are_its_ends_and_turn_about_its_axis() {
        let tube = capsule(240.0, 20.0, 61, 24);
        let deformation = ControlPointDeformation::new(&tube).unwrap();
        let mean = |control_point: &ControlPoint| {
            let points = control_point
                .vertices
                .iter()
                .map(|&v| deformation.welding.mesh().vertices()[v]);
            points.sum::<DVec3>() / control_point.vertices.len() as f64
        };
        let (one, other) = (&deformation.control_points[0], &deformation.control_points[1]);
        // The poles are at 120 mm; a region reaches 0.08 of the way, 22 mm, down from them.
        assert!(mean(one).x.abs() > 110.0 && (mean(one).x + mean(other).x).abs() < 3.0);
        for control_point in [one, other] {
            assert!(
                control_point.joint.truncate().y.abs() < 1.0 && control_point.joint.z.abs() < 1.0,
                "{}",
                control_point.joint
            );
            assert!(control_point.joint.x.abs() < mean(control_point).x.abs() - 10.0);
            assert_eq!(control_point.turns, 1.0);
        }
        // From pole to pole: a half circle and the straight part, along edges.
        let expected = 200.0 + std::f64::consts::PI * 20.0;
        assert!(
            (deformation.length / expected - 1.0).abs() < 0.05,
            "{}",
            deformation.length
        );
    }
}
