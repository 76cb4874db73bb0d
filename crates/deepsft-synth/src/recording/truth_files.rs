//! The true surface of a frame as other programs write it: a mesh, or points that are registered to the template.

use super::frame_files::read;
use crate::error::SynthError;
use deepsft_formats::{FormatError, decode_picture, mesh_vertices, read_scan, rows_from_npy};
use deepsft_geometry::fitting::SurfaceLocator;
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{
    ArapCompletion, CompletionOptions, GeometryError, Picture, Template, TriangleMesh, VertexPoint, least_squares,
};
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::path::Path;

/// What an error calls a file of them.
pub(super) const TRUTH: &str = "truth";

/// Points around a place of the template of which a quadratic surface is fitted: twice its six unknowns.
const NEIGHBOURS: usize = 12;

/// Where the middle of these points is farther from the place than this fraction of the farthest, the place is beside them. In the corner of a
/// sheet that is covered with points it is 0.6.
const BESIDE: f64 = 0.7;

/// Two points are at most this many times as far apart in space as on the template.
const MAX_STRETCH: f64 = 2.0;

/// Fewest vertices that show the pose of the others.
const MIN_VERTICES: usize = 6;

/// Steps in the texture at which a face is looked for where there is none: places of the border are rounded.
const ROUNDING: f64 = 1e-4;

/// A surface in the camera's frame.
pub(super) struct TrueSurface {
    /// Of the template's mesh, mm.
    pub(super) vertices_camera: Vec<DVec3>,
    /// The template's mesh with the faces whose vertices the file tells; the other vertices are recovered by ARAP.
    pub(super) told: TriangleMesh,
    /// The points that tell them, if points do.
    cloud: Option<Cloud>,
}

impl TrueSurface {
    /// Whether the file tells the surface at a place of these faces, mm in the texture.
    pub(super) fn tells(&self, place: DVec2) -> bool {
        (self.cloud.as_ref()).is_none_or(|cloud| points_around(cloud, place).is_some())
    }
}

/// Whether a file may hold a surface, by its name.
pub(super) fn is_truth(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    let endings = ["obj", "ply", "npy", "txt", "csv", "xyz"];
    endings.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Reads the surface of a frame, whose unit is `mm_per_unit` millimetres.
///
/// # Errors
/// [`FormatError::Unusable`] says what is wrong with the file.
pub(super) fn read_truth(path: &Path, template: &Template, mm_per_unit: f64) -> Result<TrueSurface, SynthError> {
    read(TRUTH, path, |bytes| {
        let name = path.to_string_lossy();
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let text = |error: FormatError| error.to_string();
        let (told, cloud) = match ending.to_str() {
            Some("obj" | "ply") => (of_mesh(&name, bytes, template.mesh(), mm_per_unit)?, None),
            Some("npy") => of_rows(&rows_from_npy(bytes).map_err(text)?, template, mm_per_unit)?,
            _ => of_rows(&text_rows(bytes)?, template, mm_per_unit)?,
        };
        let mesh = template.mesh();
        check(&told, mesh)?;
        let (vertices, uvs) = (mesh.vertices().to_vec(), mesh.texture_coordinates().to_vec());
        let faces = mesh
            .faces()
            .iter()
            .filter(|face| face.iter().all(|&vertex| told[vertex].is_some()));
        let surface = || -> Result<TrueSurface, GeometryError> {
            Ok(TrueSurface {
                vertices_camera: completed(&told, mesh)?,
                told: TriangleMesh::new(vertices, uvs, faces.copied().collect())?,
                cloud,
            })
        };
        surface().map_err(|error| error.to_string())
    })
}

/// Vertices of the template, mm, as far as a file tells them.
type Told = Vec<Option<DVec3>>;

/// A mesh with texture coordinates tells the template's vertices by them, one without by its vertices' numbers.
fn of_mesh(name: &str, bytes: &[u8], mesh: &TriangleMesh, mm_per_unit: f64) -> Result<Told, String> {
    let nothing_beside = |_: &Path| Err(FormatError::Scan(String::new()));
    let no_picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
    let scan = read_scan(name, bytes, Some(no_picture), &decode_picture, &nothing_beside);
    let (mut points, mut places, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for part in scan.map_or_else(|_| Vec::new(), |scan| scan.parts) {
        faces.extend(part.faces.iter().map(|face| face.map(|corner| corner + points.len())));
        points.extend(part.positions.iter().map(|point| point * mm_per_unit));
        places.extend(part.texture_coordinates);
    }
    if faces.is_empty() {
        let vertices = mesh_vertices(name, bytes).map_err(|error| error.to_string())?;
        return of_vertices(vertices.iter().map(|vertex| vertex * mm_per_unit), mesh);
    }
    let surface = TriangleMesh::new(points, places, faces).map_err(|error| error.to_string())?;
    let locator = SurfaceLocator::new(&surface);
    let steps = [(0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)].map(DVec2::from);
    let located = |uv: &DVec2| steps.iter().find_map(|step| locator.locate(uv + ROUNDING * step));
    let point = |uv| Some(located(uv)?.position(surface.faces(), surface.vertices()));
    Ok(mesh.texture_coordinates().iter().map(point).collect())
}

fn of_vertices(vertices: impl ExactSizeIterator<Item = DVec3>, mesh: &TriangleMesh) -> Result<Told, String> {
    let (own, expected) = (vertices.len(), mesh.vertices().len());
    match own == expected {
        true => Ok(vertices
            .map(|vertex| Some(vertex).filter(|vertex| vertex.is_finite()))
            .collect()),
        false => Err(format!(
            "it has {own} vertices, the template {expected}: give them the template's texture coordinates, which tell where they belong"
        )),
    }
}

/// Rows of numbers: `u v x y z`, or `vertex x y z`, or `x y z` for every vertex of the template.
fn of_rows(rows: &[Vec<f64>], template: &Template, mm_per_unit: f64) -> Result<(Told, Option<Cloud>), String> {
    let mesh = template.mesh();
    let columns = rows.first().map_or(0, Vec::len);
    if let Some((row, values)) = (1..).zip(rows).find(|(_, row)| row.len() != columns) {
        let own = values.len();
        return Err(format!("row {row} has {own} numbers, the first {columns}"));
    }
    let point = |row: &Vec<f64>| DVec3::from_slice(&row[columns - 3..]) * mm_per_unit;
    let finite = rows.iter().filter(|row| row.iter().all(|number| number.is_finite()));
    match columns {
        3 => Ok((of_vertices(rows.iter().map(point), mesh)?, None)),
        4 => {
            let mut told = vec![None; mesh.vertices().len()];
            for row in finite {
                let number = Some(row[0]).filter(|number| *number >= 0.0 && number.fract() == 0.0);
                let vertex = number.and_then(|number| told.get_mut(number as usize));
                *vertex.ok_or_else(|| format!("there is no vertex {}: they count from 0", row[0]))? = Some(point(row));
            }
            Ok((told, None))
        }
        5 => {
            let size_mm = template.size_mm();
            let place = |row: &[f64]| (DVec2::from_slice(row) * size_mm).to_array();
            let cloud = Cloud::bulk_load(finite.map(|row| GeomWithData::new(place(row), point(row))).collect());
            let uvs = mesh.texture_coordinates().iter();
            Ok((uvs.map(|uv| interpolated(&cloud, uv * size_mm)).collect(), Some(cloud)))
        }
        _ => Err(format!(
            "its rows have {columns} numbers: u v x y z, vertex x y z, or x y z are expected"
        )),
    }
}

/// Points in space by their places on the template, all mm.
type Cloud = RTree<GeomWithData<[f64; 2], DVec3>>;

/// The points around `place`, the nearest first, and where they are from it on the template. `None` beside them.
fn points_around(cloud: &Cloud, place: DVec2) -> Option<Vec<(DVec2, DVec3)>> {
    let around = cloud.nearest_neighbor_iter(place.to_array()).take(NEIGHBOURS);
    let around: Vec<_> = around
        .map(|point| (DVec2::from(*point.geom()) - place, point.data))
        .collect();
    let middle = around.iter().map(|(offset, _)| *offset).sum::<DVec2>() / NEIGHBOURS as f64;
    let is_among = around.len() == NEIGHBOURS && middle.length() <= BESIDE * around[NEIGHBOURS - 1].0.length();
    is_among.then_some(around)
}

/// The point at `place`: a quadratic surface is fitted to those around it, the nearest ones most.
fn interpolated(cloud: &Cloud, place: DVec2) -> Option<DVec3> {
    let around = points_around(cloud, place)?;
    let reach = around.last()?.0.length();
    let fitted = |axis: usize| {
        let equations = around.iter().map(|(offset, point)| {
            let DVec2 { x, y } = offset / reach;
            let weight = (x * x + y * y + 1e-4).recip().sqrt();
            let terms = [1.0, x, y, x * x, x * y, y * y].map(|term| weight * term);
            (terms, weight * point[axis])
        });
        Some(least_squares(equations)?[0])
    };
    let point = DVec3::new(fitted(0)?, fitted(1)?, fitted(2)?);
    // Points along a line tell nothing beside it.
    (point.distance(around.first()?.1) <= MAX_STRETCH * reach).then_some(point)
}

/// Says what keeps vertices from being the template's in the camera's frame.
fn check(told: &[Option<DVec3>], mesh: &TriangleMesh) -> Result<(), String> {
    let count = told.iter().flatten().count();
    if count < MIN_VERTICES {
        return Err(format!(
            "it tells {count} of the template's {} vertices: at least {MIN_VERTICES} are needed",
            told.len()
        ));
    }
    if told.iter().flatten().any(|point| point.z <= 0.0) {
        return Err("it is behind the camera: x points right, y down and z forward".to_owned());
    }
    let (mut rest, mut length) = (0.0, 0.0);
    for [a, b] in mesh.edges() {
        if let (Some(p), Some(q)) = (told[a], told[b]) {
            rest += mesh.vertices()[a].distance(mesh.vertices()[b]);
            length += p.distance(q);
        }
    }
    let stretch: f64 = length / rest;
    if stretch > MAX_STRETCH || stretch < MAX_STRETCH.recip() {
        return Err(format!(
            "its edges are {stretch:.3} times as long as the template's: correct the unit, the template, or its texture coordinates"
        ));
    }
    Ok(())
}

/// All vertices of the template: those that are told where they are, and the others as rigidly as possible.
fn completed(told: &[Option<DVec3>], mesh: &TriangleMesh) -> Result<Vec<DVec3>, GeometryError> {
    if let Some(vertices) = told.iter().copied().collect() {
        return Ok(vertices);
    }
    let point = |(vertex, point): (usize, &Option<DVec3>)| {
        Some(VertexPoint {
            vertex,
            p_camera: (*point)?,
            weight: 1.0,
        })
    };
    let points: Vec<_> = told.iter().enumerate().filter_map(point).collect();
    let mut completion = ArapCompletion::new(mesh, CompletionOptions::default())?;
    let mut vertices = completion.complete(&points, None)?.vertices;
    points.iter().for_each(|point| vertices[point.vertex] = point.p_camera);
    Ok(vertices)
}

/// The numbers of a text: separated by spaces, tabs, commas or semicolons; what follows `#` is a comment.
fn text_rows(bytes: &[u8]) -> Result<Vec<Vec<f64>>, String> {
    let text = str::from_utf8(bytes).map_err(|_| "it is no text")?;
    let mut rows = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        let words = line.split(|c: char| c.is_whitespace() || ",;".contains(c));
        let row: Result<Vec<f64>, _> = words.filter(|word| !word.is_empty()).map(str::parse).collect();
        let row = row.map_err(|_| format!("line {number} is no row of numbers: {line:?}"))?;
        if !row.is_empty() {
            rows.push(row);
        }
    }
    Ok(rows)
}
