//! A scanned sheet laid flat.

use crate::error::{GeometryError, Result, TemplateError};
use crate::image::{MipLevel, Picture, luma};
use crate::mesh::{SurfaceLocator, Template, Topology, TriangleMesh, Welding};
use crate::sheet_sides::sheet_sides;
use crate::solver::cholesky::SparseCholesky;
use glam::{DMat2, DVec2, DVec3};
use std::collections::{BTreeMap, VecDeque};
use thiserror::Error;

/// Most faces of a scan: the flat layout then takes some seconds in a browser.
const MAX_FACES: usize = 200_000;

/// Most mean stretch of a sheet. A cap of a ball that reaches 45 degrees to each side has 4 %, a scan with 0.25 mm of noise on triangles of 5 mm 0.3 %.
const MAX_STRETCH: f64 = 0.04;

/// Least fraction of its rectangle that a sheet fills: round corners and frayed borders leave more.
const MIN_FILLED: f64 = 0.9;

/// How far the sides of a sheet are apart, a fraction of its shorter side: of a bank card 0.014.
const MAX_THICKNESS: f64 = 0.02;

/// Two sides have the same detail when the lesser has more than this fraction of the other's.
const ALIKE: f64 = 0.9;

/// Places along a side at which detail is measured, and the part of it at each end that may show the rim.
const DETAIL_PX: usize = 256;
const MARGIN: f64 = 0.05;

/// Longest side of the flat picture, pixels: finer detail than a camera sees at any distance.
const LONGEST_SIDE: f64 = 2000.0;

/// A place beside the surface (a hole, a round corner) has the colour of the nearest place towards the middle, in steps of this
/// fraction of the way.
const INWARDS: f64 = 0.01;

/// Why a scan cannot be laid flat.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum UnrollError {
    /// A scan has so many faces: more than can be laid flat.
    #[error("mesh has {0} faces, more than the {most} that can be laid flat: export it with fewer", most = MAX_FACES)]
    Faces(usize),
    /// A scan of a sheet is in so many pieces.
    #[error("mesh is in {0} pieces, a sheet is one: keep the sheet alone and delete what flies around it")]
    Pieces(usize),
    /// A closed surface has no front that could be laid flat.
    #[error("mesh is closed, so it has a volume and cannot be laid flat; of a sheet, keep its front alone")]
    WithoutBorder,
    /// A surface cannot be laid flat without stretching it so much, percent on average.
    #[error(
        "surface stretches by {0:.0} % when it is laid flat, a sheet by {most:.0} % at most: it bulges or closes to a tube",
        most = 100.0 * MAX_STRETCH
    )]
    Stretch(f64),
    /// The outline of a sheet is no rectangle: it fills so much of the one around it, percent.
    #[error(
        "surface fills {0:.0} % of the rectangle around it when it is laid flat, expected {least:.0} % or more: only \
         rectangular sheets can be followed",
        least = 100.0 * MIN_FILLED
    )]
    Outline(f64),
    /// The scan's mesh or the flat sheet cannot be used.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// The flat layout cannot be solved for.
    #[error(transparent)]
    Layout(#[from] GeometryError),
}

/// A sheet that was made of a scan.
#[derive(Clone, Debug)]
pub struct UnrolledSheet {
    /// The flat sheet with what is on the scan's front.
    pub template: Template,
    /// Mean stretch or compression of the faces, a fraction: 0 for anything that paper can be bent to.
    pub stretch: f64,
    /// How far its back is away, mm, which the scan has too and which was left out.
    pub back_mm: Option<f64>,
}

/// Flattens a scanned sheet: a bent sheet of paper, a label or a curved plate as it was before. Such a surface can be
/// found and followed like a print.
///
/// The flat layout is the least-squares conformal map (Levy, Petitjean, Ray and Maillot 2002), which for a surface that unrolls without
/// stretching is its unrolling. Its rectangle is the smallest around it; the side that is up in the template frame is up in the picture,
/// and of a sheet that lies on the ground the far side.
///
/// Of a sheet that was scanned from both sides, two layers or a thin closed body, the side with more detail is taken; of two alike the one with
/// more texture.
///
/// # Errors
/// * [`UnrollError::Faces`] above 200,000 faces, [`UnrollError::Pieces`] for a surface in pieces.
/// * [`UnrollError::WithoutBorder`] for a closed surface.
/// * [`UnrollError::Stretch`] for a surface with a volume: it bulges, or closes to a tube.
/// * [`UnrollError::Outline`] where the outline is no rectangle.
pub fn unroll(template: &Template) -> Result<UnrolledSheet, UnrollError> {
    let faces = template.mesh().faces().len();
    if faces > MAX_FACES {
        return Err(UnrollError::Faces(faces));
    }
    let welding = Welding::of(template.mesh())?;
    match side_with_more(template, &welding) {
        Some(sheet) => Ok(sheet),
        None => unroll_side(template, &welding),
    }
}

/// The more detailed side of a sheet that has both, laid flat.
fn side_with_more(template: &Template, welding: &Welding) -> Option<UnrolledSheet> {
    let (sides, distance) = sheet_sides(welding.mesh())?;
    let unrolled = sides.map(|faces| {
        let side = Template::of_mesh(part_of(template.mesh(), &faces).ok()?, template.texture().clone()).ok()?;
        let sheet = unroll_side(&side, &Welding::of(side.mesh()).ok()?).ok()?;
        (distance < MAX_THICKNESS * sheet.template.size_mm().min_element()).then_some(sheet)
    });
    let [one, other] = unrolled;
    let sheet = match (one, other) {
        (Some(one), Some(other)) => {
            let of = |sheet: &UnrolledSheet| (detail(sheet.template.texture()), sheet.template.texture().size().area());
            let ((detail, texels), (detail_there, texels_there)) = (of(&one), of(&other));
            let are_alike = detail.min(detail_there) > ALIKE * detail.max(detail_there);
            let is_first = if are_alike {
                texels >= texels_there
            } else {
                detail > detail_there
            };
            if is_first { one } else { other }
        }
        (one, other) => one.or(other)?,
    };
    Some(UnrolledSheet {
        back_mm: Some(distance),
        ..sheet
    })
}

fn part_of(mesh: &TriangleMesh, faces: &[usize]) -> Result<TriangleMesh, TemplateError> {
    let mut vertices: Vec<usize> = faces.iter().flat_map(|&face| mesh.faces()[face]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let renamed = |v: usize| vertices.partition_point(|&kept| kept < v);
    TriangleMesh::new(
        vertices.iter().map(|&v| mesh.vertices()[v]).collect(),
        vertices.iter().map(|&v| mesh.texture_coordinates()[v]).collect(),
        faces.iter().map(|&face| mesh.faces()[face].map(renamed)).collect(),
    )
}

/// Mean difference of neighbouring pixels at about the same resolution of both pictures.
fn detail(picture: &Picture) -> f64 {
    let side = picture.width().min(picture.height()).max(1);
    let small = MipLevel::halved(picture.clone(), (side / DETAIL_PX).max(1).ilog2());
    let grey = |x: usize, y: usize| {
        let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / DETAIL_PX as f64;
        let at = DVec2::splat(MARGIN) + (1.0 - 2.0 * MARGIN) * at;
        f64::from(luma(small.sample(at).map(|value| value.round() as u8)))
    };
    let places = (0..DETAIL_PX - 1).flat_map(|y| (0..DETAIL_PX - 1).map(move |x| (x, y)));
    let sum: f64 = places
        .map(|(x, y)| (grey(x + 1, y) - grey(x, y)).abs() + (grey(x, y + 1) - grey(x, y)).abs())
        .sum();
    sum / (DETAIL_PX * DETAIL_PX) as f64
}

fn unroll_side(template: &Template, welding: &Welding) -> Result<UnrolledSheet, UnrollError> {
    let topology = Topology::of(template.mesh())?;
    if topology.border_edges == 0 {
        return Err(UnrollError::WithoutBorder);
    }
    if topology.pieces > 1 {
        return Err(UnrollError::Pieces(topology.pieces));
    }
    let (flat, stretch) = flat_layout(welding.mesh())?;
    if stretch > MAX_STRETCH {
        return Err(UnrollError::Stretch(100.0 * stretch));
    }
    let (flat, size) = upright(&flat, welding.mesh());
    let filled = area(&flat, welding.mesh()) / (size.x * size.y);
    if filled < MIN_FILLED {
        return Err(UnrollError::Outline(100.0 * filled));
    }
    let picture = flat_picture(template, welding, &flat, size)?;
    Ok(UnrolledSheet {
        template: Template::thin_shell(picture, size.x, size.y)?,
        stretch,
        back_mm: None,
    })
}

/// The corners of a face in its own plane, mm: x along its first side, y to the right of it seen from the front, as on the sheet.
fn in_plane([a, b, c]: [DVec3; 3]) -> [DVec2; 3] {
    let (e, f) = (b - a, c - a);
    let x = e.normalize_or_zero();
    let y = x.cross(e.cross(f).normalize_or_zero());
    [DVec2::ZERO, DVec2::new(e.length(), 0.0), DVec2::new(f.dot(x), f.dot(y))]
}

/// The vertices in the plane, of the surface's own area, and the mean stretch.
fn flat_layout(mesh: &TriangleMesh) -> Result<(Vec<DVec2>, f64)> {
    let count = mesh.vertices().len();
    let pins = far_apart(mesh);
    let distance = mesh.vertices()[pins[0]].distance(mesh.vertices()[pins[1]]);
    let mut flat = vec![DVec2::ZERO; count];
    flat[pins[1]] = DVec2::new(distance.max(1.0), 0.0);
    // Two unknowns for each vertex that is not pinned.
    let mut unknown = vec![None; count];
    let mut free = 0;
    for vertex in (0..count).filter(|vertex| !pins.contains(vertex)) {
        unknown[vertex] = Some(2 * free);
        free += 1;
    }
    let mut columns: Vec<BTreeMap<usize, f64>> = vec![BTreeMap::new(); 2 * free];
    let mut right_hand_side = vec![0.0; 2 * free];
    for face in mesh.faces() {
        let [p, q, r] = in_plane(face.map(|v| mesh.vertices()[v]));
        let doubled_area = (q - p).perp_dot(r - p).abs();
        if doubled_area <= 0.0 {
            continue;
        }
        // A face keeps its shape where its corners, as complex numbers, times these add up to 0.
        let sides = [r - q, p - r, q - p];
        for (j, &one) in face.iter().enumerate() {
            let Some(row) = unknown[one] else { continue };
            for (k, &other) in face.iter().enumerate() {
                let (real, imaginary) = (sides[j].dot(sides[k]), sides[j].perp_dot(sides[k]));
                let block = [[real, -imaginary], [imaginary, real]].map(|row| row.map(|value| value / doubled_area));
                for (i, values) in block.iter().enumerate() {
                    for (l, value) in values.iter().enumerate() {
                        match unknown[other] {
                            None => right_hand_side[row + i] -= value * flat[other][l],
                            Some(column) if row + i >= column + l => {
                                *columns[column + l].entry(row + i).or_default() += value;
                            }
                            Some(_) => {}
                        }
                    }
                }
            }
        }
    }
    if free > 0 {
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for column in columns {
            rows.extend(column.keys());
            values.extend(column.values());
            starts.push(rows.len());
        }
        let mut cholesky = SparseCholesky::new(starts, rows)?;
        cholesky.factorize(&values)?;
        cholesky.solve(&mut right_hand_side);
    }
    for (position, unknown) in flat.iter_mut().zip(&unknown) {
        if let Some(at) = *unknown {
            *position = DVec2::new(right_hand_side[at], right_hand_side[at + 1]);
        }
    }
    let area_of_face = |face: &[usize; 3]| {
        let [a, b, c] = face.map(|v| mesh.vertices()[v]);
        (b - a).cross(c - a).length() / 2.0
    };
    let own_area: f64 = mesh.faces().iter().map(area_of_face).sum();
    let scale = (own_area / area(&flat, mesh)).sqrt();
    flat.iter_mut().for_each(|position| *position *= scale);
    let stretch = mean_stretch(&flat, mesh) / own_area;
    Ok((flat, if stretch.is_finite() { stretch } else { f64::INFINITY }))
}

/// Area of the layout; faces that lie on their fronts count as negative.
fn area(flat: &[DVec2], mesh: &TriangleMesh) -> f64 {
    let of_face = |face: &[usize; 3]| {
        let [a, b, c] = face.map(|v| flat[v]);
        (c - a).perp_dot(b - a) / 2.0
    };
    let sum: f64 = mesh.faces().iter().map(of_face).sum();
    sum.abs()
}

/// How much faces are stretched or pressed, times their area.
fn mean_stretch(flat: &[DVec2], mesh: &TriangleMesh) -> f64 {
    let of_face = |face: &[usize; 3]| {
        let [_, q, r] = in_plane(face.map(|v| mesh.vertices()[v]));
        let [a, b, c] = face.map(|v| flat[v]);
        let own = DMat2::from_cols(q, r);
        let doubled_area = own.determinant().abs();
        if doubled_area <= 0.0 {
            return 0.0;
        }
        let map = DMat2::from_cols(b - a, c - a) * own.inverse();
        // Its singular values by its similar and its mirrored part.
        let [x, y] = [map.x_axis, map.y_axis];
        let similar = DVec2::new(x.x + y.y, x.y - y.x).length() / 2.0;
        let mirrored = DVec2::new(x.x - y.y, x.y + y.x).length() / 2.0;
        let (most, least) = (similar + mirrored, similar - mirrored);
        // What is turned over does not unroll.
        let stretch = if least > 0.0 { most.max(1.0 / least) - 1.0 } else { 1.0 };
        stretch.min(1.0) * doubled_area / 2.0
    };
    mesh.faces().iter().map(of_face).sum()
}

/// Two vertices with many edges between them.
fn far_apart(mesh: &TriangleMesh) -> [usize; 2] {
    let mut neighbours = vec![Vec::new(); mesh.vertices().len()];
    for [a, b] in mesh.edges() {
        neighbours[a].push(b);
        neighbours[b].push(a);
    }
    let farthest = |from: usize| {
        let mut seen = vec![false; neighbours.len()];
        seen[from] = true;
        let (mut queue, mut last) = (VecDeque::from([from]), from);
        while let Some(vertex) = queue.pop_front() {
            last = vertex;
            for &next in &neighbours[vertex] {
                if !std::mem::replace(&mut seen[next], true) {
                    queue.push_back(next);
                }
            }
        }
        last
    };
    let one = farthest(mesh.faces()[0][0]);
    [one, farthest(one)]
}

/// The layout with its smallest rectangle along the axes and its corner at the origin, the side that is up in the template frame
/// uppermost; and the rectangle's size.
fn upright(flat: &[DVec2], mesh: &TriangleMesh) -> (Vec<DVec2>, DVec2) {
    let hull = convex_hull(flat);
    let bounds = |axis: DVec2| {
        let along = |p: &DVec2| DVec2::new(p.dot(axis), p.dot(axis.perp()));
        let around = |(low, high): (DVec2, DVec2), p: DVec2| (low.min(p), high.max(p));
        (hull.iter().map(along)).fold((DVec2::INFINITY, DVec2::NEG_INFINITY), around)
    };
    let mut best = (f64::INFINITY, DVec2::X);
    for (k, &corner) in hull.iter().enumerate() {
        let Some(axis) = (hull[(k + 1) % hull.len()] - corner).try_normalize() else {
            continue;
        };
        let (low, high) = bounds(axis);
        let size = high - low;
        if size.x * size.y < best.0 {
            best = (size.x * size.y, axis);
        }
    }
    // Where the layout's axes point in space, on average; not of length 1.
    let (mut right, mut down) = (DVec3::ZERO, DVec3::ZERO);
    for face in mesh.faces() {
        let [a, b, c] = face.map(|v| mesh.vertices()[v]);
        let [p, q, r] = face.map(|v| flat[v]);
        let (s, t) = (q - p, r - p);
        // Times twice the face's area in the layout.
        let sign = s.perp_dot(t).signum();
        right += ((b - a) * t.y - (c - a) * s.y) * sign;
        down += ((c - a) * s.x - (b - a) * t.x) * sign;
    }
    // Of its four turns the one whose x runs to the right and whose y runs down, or towards the viewer, in space.
    let in_space = |axis: DVec2| right * axis.x + down * axis.y;
    let score = |axis: &DVec2| in_space(*axis).x + in_space(axis.perp()).dot(DVec3::new(0.0, 1.0, -1.0));
    let turns = [best.1, best.1.perp(), -best.1, -best.1.perp()];
    let upmost = turns.into_iter().max_by(|a, b| score(a).total_cmp(&score(b)));
    let axis = upmost.unwrap_or(best.1);
    let (low, high) = bounds(axis);
    let laid = flat.iter().map(|p| DVec2::new(p.dot(axis), p.dot(axis.perp())) - low);
    (laid.collect(), high - low)
}

/// Andrew's monotone chain.
fn convex_hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut hull: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = hull[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut sorted.iter().copied());
    hull.extend(chain(&mut sorted.iter().rev().copied()));
    hull
}

/// What is on the surface, in the rectangle of `size` mm.
fn flat_picture(template: &Template, welding: &Welding, flat: &[DVec2], size: DVec2) -> Result<Picture, TemplateError> {
    let mesh = template.mesh();
    let (uv, faces) = (mesh.texture_coordinates(), mesh.faces());
    let layout = TriangleMesh::new(
        welding.mesh().vertices().to_vec(),
        flat.iter().map(|p| *p / size).collect(),
        welding.mesh().faces().to_vec(),
    )?;
    let texture = template.texture();
    let used_of_face = |face: &[usize; 3]| {
        let [p, q, r] = face.map(|v| uv[v]);
        (q - p).perp_dot(r - p).abs() / 2.0
    };
    let used: f64 = faces.iter().map(used_of_face).sum();
    // As fine as the texture is on the surface.
    let texels = used * (texture.width() * texture.height()) as f64;
    let of_texture = (texels / (size.x * size.y)).sqrt();
    let per_mm = of_texture.min(LONGEST_SIDE / size.max_element());
    let side = |length: f64| ((length * per_mm).round() as usize).max(1);
    let (width, height) = (side(size.x), side(size.y));
    // No texel is passed over where the picture is coarser: at most 1.5 texels a pixel.
    let texels_per_pixel = (texels / (width * height) as f64).sqrt();
    let most = texture.width().min(texture.height()).ilog2();
    let halvings = (texels_per_pixel / 1.5).log2().ceil().max(0.0) as u32;
    let texture = MipLevel::halved(texture.clone(), halvings.min(most));
    let locator = SurfaceLocator::new(&layout);
    Ok(Picture::from_fn(width, height, |x, y| {
        let at = DVec2::new((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64);
        let mut inwards = (0..(1.0 / INWARDS) as usize).map(|step| at.lerp(DVec2::splat(0.5), INWARDS * step as f64));
        let Some(point) = inwards.find_map(|at| locator.locate(at)) else {
            return [255; 3];
        };
        let corners = faces[point.face].iter().zip(point.barycentric);
        let place: DVec2 = corners.map(|(&v, weight)| uv[v] * weight).sum();
        texture.sample(place).map(|value| value.round() as u8)
    }))
}
