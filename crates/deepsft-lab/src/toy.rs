//! A volumic template made by our own code: a soft toy, a rabbit patched together from 18 pieces of cloth.
//!
//! Its shape is a blend of rounded limbs (`body.rs`), meshed on a grid (`surface_nets.rs`). The surface is cut into pieces
//! along limbs and side seams (`sewing.rs`), each piece laid flat (`flattening.rs`) and painted as its own cloth
//! (`fabric.rs`, `painting.rs`). Nothing is read from a file and nothing is random: every call gives the same template.

mod body;
mod fabric;
mod flattening;
mod painting;
mod sewing;
mod surface_nets;

use anyhow::Result;
use body::BOUNDS_MM;
use deepsft_formats::pack_rectangles;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Template, TriangleMesh};
use sewing::Piece;
use surface_nets::Implicit;

/// Side of the cells on which the surface is meshed, mm.
const CELL_MM: f64 = 6.0;

/// Side of the texture, texels.
const TEXTURE_SIDE: usize = 1024;

/// Texels between two pieces in the texture.
const GAP: usize = 14;

/// Most texels a millimetre, and the factor by which fewer are tried until all pieces fit.
const FINEST_SCALE: f64 = 6.0;
const SCALE_STEP: f64 = 0.985;

/// The soft toy: a closed surface of genus 0 about 300 mm high and 200 mm wide, of 7,100 faces, with 18 charts in a
/// texture of 1024 x 1024 texels. It stands upright (head towards -y) and looks towards -z. Left and right differ
/// everywhere.
///
/// # Errors
/// None: the type is that of the steps, which could fail on another shape.
pub fn toy_template() -> Result<Template> {
    let implicit = Implicit {
        value: &body::distance,
        gradient: &body::gradient,
    };
    let (mut vertices, faces) = implicit.mesh(BOUNDS_MM, CELL_MM);
    let pieces = sewing::pieces(&implicit, &mut vertices, &faces);
    let (corners, scale) = layout(&pieces);
    let texture = painting::paint(&pieces, &vertices, &corners, scale, TEXTURE_SIDE);
    Ok(Template::of_mesh(
        sewn_mesh(&pieces, &vertices, &corners, scale)?,
        texture,
    )?)
}

/// Where each piece lies in the texture (its corner, texels), and texels a millimetre.
fn layout(pieces: &[Piece]) -> (Vec<DVec2>, f64) {
    let mut scale = FINEST_SCALE;
    loop {
        let size = |piece: &Piece| {
            let texels = (piece.size_mm * scale).ceil();
            (texels.x as usize, texels.y as usize)
        };
        let sizes: Vec<_> = pieces.iter().map(size).collect();
        if let Some((corners, height)) = pack_rectangles(&sizes, TEXTURE_SIDE, GAP)
            && height <= TEXTURE_SIDE
        {
            let corners = corners.into_iter().map(|(x, y)| DVec2::new(x as f64, y as f64));
            return (corners.collect(), scale);
        }
        scale *= SCALE_STEP;
    }
}

/// The pieces as one mesh with texture coordinates; vertices on seams stand in it once for each piece.
fn sewn_mesh(pieces: &[Piece], positions: &[DVec3], corners: &[DVec2], scale: f64) -> Result<TriangleMesh> {
    let (mut vertices, mut texture_coordinates, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for (piece, corner) in pieces.iter().zip(corners) {
        let first = vertices.len();
        vertices.extend(piece.vertices.iter().map(|&v| positions[v]));
        let texel = |flat: &DVec2| (*corner + *flat * scale) / TEXTURE_SIDE as f64;
        texture_coordinates.extend(piece.flat_mm.iter().map(texel));
        faces.extend(piece.faces.iter().map(|face| face.map(|v| first + v)));
    }
    Ok(TriangleMesh::new(vertices, texture_coordinates, faces)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Topology, Welding};
    use deepsft_synth::{ControlPointConfig, ControlPointDeformation, edge_length_change};
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn the_toy_is_one_closed_ball_of_many_faces_sewn_from_many_charts() {
        let toy = toy_template().unwrap();
        let topology = Topology::of(toy.mesh()).unwrap();
        assert_eq!(topology.genus(), Some(0));
        // Front and back of head, two ears, two arms, two legs and body, the body's back in two, and the tail.
        assert_eq!(topology.charts, 18);
        assert!(topology.seam_edges > 200, "{topology:?}");
        assert!(toy.mesh().faces().len() >= 5000);
        let v = toy.mesh().vertices();
        let volume: f64 = toy
            .mesh()
            .faces()
            .iter()
            .map(|&[a, b, c]| v[a].dot(v[b].cross(v[c])))
            .sum();
        assert!(volume > 0.0, "the fronts of the faces are inside");
    }

    #[test]
    fn every_chart_is_a_disc_without_folds_and_little_stretched() {
        let toy = toy_template().unwrap();
        let mesh = toy.mesh();
        let (v, uv) = (mesh.vertices(), mesh.texture_coordinates());
        let mut stretch = Vec::new();
        for face in mesh.faces() {
            let [a, b, c] = face.map(|i| v[i]);
            let [p, q, r] = face.map(|i| uv[i]);
            let flat = (q - p).perp_dot(r - p);
            assert!(flat < 0.0, "a face of the texture is turned over");
            stretch.push(-flat / (b - a).cross(c - a).length());
        }
        stretch.sort_unstable_by(f64::total_cmp);
        let at = |fraction: f64| stretch[(fraction * (stretch.len() - 1) as f64) as usize];
        // Area in the texture per area of the surface, between its 2nd and 98th percentile: a half ball laid flat as a disc
        // that keeps lengths along its meridians has from 1 to pi / 2, and the muzzle and the feet come on top.
        assert!(at(0.98) / at(0.02) < 3.0, "{}", at(0.98) / at(0.02));
        // A disc has Euler characteristic 1, and there is no hole in any chart: as many as there are charts.
        let topology = Topology::of(mesh).unwrap();
        let mut apart = mesh.edges().len() as i64;
        apart = v.len() as i64 - apart + mesh.faces().len() as i64;
        assert_eq!(apart, topology.charts as i64);
    }

    #[test]
    fn edges_are_even_and_left_is_not_right() {
        let toy = toy_template().unwrap();
        let welded = Welding::of(toy.mesh()).unwrap();
        let v = welded.mesh().vertices();
        let mut lengths: Vec<f64> = welded
            .mesh()
            .edges()
            .iter()
            .map(|&[a, b]| v[a].distance(v[b]))
            .collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let at = |fraction: f64| lengths[(fraction * (lengths.len() - 1) as f64) as usize];
        assert!(at(0.99) / at(0.01) < 6.0, "{} to {}", at(0.01), at(0.99));
        // Colours at mirrored places of the surface differ by more than the pile.
        let (texture, uv) = (toy.texture(), toy.mesh().texture_coordinates());
        let color = |i: usize| {
            let texel = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
            texture.pixel(texel(uv[i].x, texture.width()), texel(uv[i].y, texture.height()))
        };
        let points = toy.mesh().vertices();
        let (mut sum, mut count) = (0.0, 0);
        for i in (0..points.len()).step_by(7).filter(|&i| points[i].x > 8.0) {
            let mirrored = DVec3::new(-points[i].x, points[i].y, points[i].z);
            let other = (0..points.len()).min_by(|&a, &b| {
                points[a]
                    .distance_squared(mirrored)
                    .total_cmp(&points[b].distance_squared(mirrored))
            });
            let (one, other) = (color(i), color(other.unwrap()));
            sum += (0..3).map(|k| f64::from(one[k].abs_diff(other[k]))).sum::<f64>() / 3.0;
            count += 1;
        }
        assert!(sum / f64::from(count) > 35.0, "{}", sum / f64::from(count));
    }

    #[test]
    fn limbs_of_the_toy_move_far_while_edges_keep_their_length() {
        let toy = toy_template().unwrap();
        let welding = Welding::of(toy.mesh()).unwrap();
        let deformation = ControlPointDeformation::new(toy.mesh()).unwrap();
        let config = ControlPointConfig::default();
        let (mut moved, mut changes) = (Vec::new(), Vec::new());
        for seed in 0..12 {
            let shape = deformation.deform(&config, &mut Pcg64Mcg::seed_from_u64(seed));
            assert!(shape.strength > 0.0, "{seed} stays at rest");
            let vertices = shape.vertices;
            let change = edge_length_change(toy.mesh(), &vertices);
            assert!(change.median <= 0.021 && change.p95 <= 0.105, "{seed}: {change:?}");
            changes.push(change.median);
            let farthest = vertices.iter().zip(toy.mesh().vertices()).map(|(a, b)| a.distance(*b));
            moved.push(farthest.fold(0.0, f64::max));
            // Copies of a vertex on a seam stay together.
            let split = welding.split(&welding.weld(&vertices));
            assert_eq!(split, vertices);
        }
        moved.sort_unstable_by(f64::total_cmp);
        changes.sort_unstable_by(f64::total_cmp);
        // Half of the shapes move some point by more than a limb is thick.
        assert!(moved[6] > 20.0, "{moved:?}");
        assert!(changes[6] > 1e-4, "nothing bends: {changes:?}");
    }

    #[test]
    fn it_is_the_same_every_time() {
        let (one, other) = (toy_template().unwrap(), toy_template().unwrap());
        assert_eq!(one.mesh(), other.mesh());
        assert!(one.texture() == other.texture());
    }
}
