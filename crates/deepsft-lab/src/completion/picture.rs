//! Pictures of completed meshes.

use super::interpolation::laplacian;
use super::subject::{Completed, Object};
use deepsft_cli::output::color_map::ColorMap;
use deepsft_cli::output::sheet;
use deepsft_geometry::glam::{DQuat, DVec3, Vec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Picture, TriangleMesh};

const GROUND: [u8; 3] = [40, 40, 46];

/// End of the error scale on the sheet, mm.
const ERROR_SCALE_MM: f64 = 30.0;

/// How far the side view is turned, radians.
const SIDE_RAD: f64 = 1.0;

/// A mesh lit from the camera, both of its sides; `color` says what colour vertex-interpolated `values` have.
fn shaded(
    mesh: &TriangleMesh,
    vertices: &[DVec3],
    camera: &Camera,
    values: &[f64],
    color: impl Fn(f64) -> [u8; 3],
) -> Picture {
    let surface = VisibleSurface::new(mesh, vertices, camera);
    let (width, height) = (camera.width(), camera.height());
    let mut pixels = vec![GROUND; width * height];
    for (index, column, row) in surface.window().pixels() {
        let Some(face) = surface.centres().triangle(index) else {
            continue;
        };
        let Some(triangle) = &surface.triangles()[face] else {
            continue;
        };
        let at = surface.centres().position(column, row);
        let weights = triangle.barycentric(at.x, at.y);
        let value = mesh.faces()[face]
            .iter()
            .zip(weights)
            .map(|(&v, w)| w * values[v])
            .sum();
        let light = 0.35 + 0.65 * triangle.normal(at.x, at.y).dot(Vec3::NEG_Z).abs();
        pixels[row * width + column] = color(value).map(|c| (f32::from(c) * light) as u8);
    }
    Picture::from_fn(width, height, |x, y| pixels[y * width + x])
}

/// `vertices` turned about the vertical through `centre`: seen from the side.
fn turned(vertices: &[DVec3], centre: DVec3, angle: f64) -> Vec<DVec3> {
    let turn = DQuat::from_rotation_y(angle);
    vertices.iter().map(|&p| centre + turn * (p - centre)).collect()
}

/// A frame's row of the sheet: what is seen, what became of it, both from the side too.
pub fn panels(object: &Object, camera: &Camera, completed: &Completed) -> sheet::Row {
    let Completed {
        report,
        view,
        points,
        vertices,
    } = completed;
    let truth = &view.vertices_camera;
    let bar = sheet::ColorBar {
        colors: ColorMap::Inferno,
        range: [0.0, ERROR_SCALE_MM],
        unit: "mm",
    };
    let errors_of = |of: &[DVec3]| -> Vec<f64> { of.iter().zip(truth).map(|(a, b)| a.distance(*b)).collect() };
    let mut seen = vec![0.0; truth.len()];
    points.iter().for_each(|p| seen[p.vertex] = 1.0);
    let seen_color = |seen: f64| if seen > 0.5 { [110, 200, 120] } else { [120, 120, 130] };
    let centre = truth.iter().sum::<DVec3>() / truth.len().max(1) as f64;
    let side = |vertices: &[DVec3]| turned(vertices, centre, SIDE_RAD);
    let panel = |title: &str, picture: Picture, bar: Option<sheet::ColorBar>| sheet::Panel {
        title: title.to_owned(),
        picture: picture.halved(),
        bar,
    };
    let colored =
        |vertices: &[DVec3], values: &[f64]| shaded(&object.mesh, vertices, camera, values, |error| bar.color(error));
    let smooth = laplacian(&object.welding, object.mesh.vertices(), points);
    sheet::Row {
        caption: format!(
            "{} {}: {:.0} % hidden; hidden vertices ARAP {:.1}, rigid {:.1}, Laplacian {:.1} mm; visible {:.2} mm",
            object.name,
            report.index,
            100.0 * report.hidden_fraction,
            report.arap_mm,
            report.rigid_mm,
            report.laplacian_mm,
            report.visible_after_mm
        ),
        panels: vec![
            panel(
                "truth, seen green",
                shaded(&object.mesh, truth, camera, &seen, seen_color),
                None,
            ),
            panel(
                "ARAP, error",
                colored(vertices, &errors_of(vertices)),
                Some(bar.clone()),
            ),
            panel(
                "truth from the side",
                shaded(&object.mesh, &side(truth), camera, &seen, seen_color),
                None,
            ),
            panel(
                "ARAP from the side",
                colored(&side(vertices), &errors_of(vertices)),
                None,
            ),
            panel("Laplacian, side", colored(&side(&smooth), &errors_of(&smooth)), None),
        ],
    }
}
