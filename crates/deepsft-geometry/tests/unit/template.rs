//! Templates: sheets and meshes.

use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{GeometryError, Picture, SelfCalibration, Template, TemplateError, Topology, TriangleMesh};
use std::f64::consts::{PI, TAU};

fn sheet() -> Template {
    Template::thin_shell(Picture::from_fn(4, 3, |x, y| [x as u8, y as u8, 0]), 297.0, 210.0).unwrap()
}

#[test]
fn the_grid_is_centred_and_its_faces_look_at_minus_z() {
    let template = sheet();
    let mesh = template.mesh();
    let (columns, rows) = template.grid().unwrap();
    assert_eq!(mesh.vertices().len(), columns * rows);
    assert_eq!(mesh.vertices()[0], DVec3::new(-148.5, -105.0, 0.0));
    assert_eq!(
        template.point_template(DVec2::new(1.0, 0.5)),
        Some(DVec3::new(148.5, 0.0, 0.0))
    );
    let mut area = 0.0;
    for &[a, b, c] in mesh.faces() {
        let v = mesh.vertices();
        let normal = (v[b] - v[a]).cross(v[c] - v[a]);
        assert!(normal.z < 0.0);
        area += normal.length() / 2.0;
    }
    assert!((area - 297.0 * 210.0).abs() < 1e-6);
}

#[test]
fn a_finer_sheet_keeps_the_vertices_and_halves_the_cells() {
    let template = sheet();
    let finer = template.finer().unwrap();
    let ((columns, rows), (fine_columns, fine_rows)) = (template.grid().unwrap(), finer.grid().unwrap());
    assert_eq!(finer.mesh().faces().len(), 4 * template.mesh().faces().len());
    assert_eq!(finer.mesh().vertices().len(), fine_columns * fine_rows);
    for j in 0..rows {
        for i in 0..columns {
            let there = finer.mesh().vertices()[2 * j * fine_columns + 2 * i];
            // u is a quotient of small whole numbers: the same but for rounding.
            assert!(there.distance(template.mesh().vertices()[j * columns + i]) < 1e-9);
        }
    }
    assert_eq!(finer.size_mm(), template.size_mm());
}

#[test]
fn a_sheet_without_a_size_is_refused() {
    for width in [0.0, -3.0, f64::NAN, f64::INFINITY] {
        let picture = Picture::from_fn(1, 1, |_, _| [0; 3]);
        assert!(matches!(
            Template::thin_shell(picture, width, 10.0),
            Err(TemplateError::Size { side: "width", .. })
        ));
    }
}

#[test]
fn a_label_lies_on_its_cylinder_with_its_lengths() {
    let label = |width, diameter| {
        let picture = Picture::from_fn(9, 3, |_, _| [0; 3]);
        Template::around_cylinder(picture, [width, 100.0], diameter)
    };
    for (width, seam) in [(120.0, false), (60.0 * PI, true), (200.0, true)] {
        let template = label(width, 60.0).unwrap();
        assert!(!template.is_sheet());
        let (mesh, radius) = (template.mesh(), 30.0);
        for p in mesh.vertices() {
            assert!((p.x.hypot(p.z) - radius).abs() < 1e-9, "{p}");
        }
        for &[a, b, c] in mesh.faces() {
            let [a, b, c] = [a, b, c].map(|v| mesh.vertices()[v]);
            assert!(
                (b - a).cross(c - a).dot((a + b + c).with_y(0.0)) > 0.0,
                "a face looks inwards"
            );
        }
        // The middle of one turn is before the viewer; a quarter of a turn further to the right it is seen from the side.
        let turn = radius * TAU;
        let middle = width.min(turn) / 2.0 / width;
        let at = |u: f64| template.point_template(DVec2::new(u, 0.25));
        let near = |u: f64, p: DVec3| at(u).unwrap().distance(p) < 0.1;
        assert!(near(middle, DVec3::new(0.0, -25.0, -30.0)));
        assert!(near(
            middle + turn / 6.0 / width,
            DVec3::new(30.0 * (TAU / 6.0).sin(), -25.0, -15.0)
        ));
        // What is longer than a turn lies under the beginning.
        assert_eq!(at(0.99).is_none(), width > turn + 5.0);
        let topology = Topology::of(mesh).unwrap();
        let rows = mesh.texture_coordinates().iter().filter(|uv| uv.x == 0.0).count();
        assert_eq!(topology.seam_edges, if seam { rows - 1 } else { 0 });
        assert_eq!(
            (topology.pieces, topology.euler_characteristic),
            (1, if seam { 0 } else { 1 })
        );
        assert!((template.size_mm() - DVec2::new(width, 100.0)).abs().max_element() < 0.1);
    }
    for diameter in [0.0, -1.0, f64::NAN] {
        let refused = label(100.0, diameter).unwrap_err().to_string();
        assert!(refused.contains("diameter"), "{refused}");
    }
}

type Faces = Vec<[usize; 3]>;
type Change<'a> = &'a dyn Fn(&mut Vec<DVec3>, &mut Vec<DVec2>, &mut Faces);

/// A box without lid: five charts in a row of the texture, each side a square of 100 mm, the floor 100 x 200 mm.
fn open_box() -> (Vec<DVec3>, Vec<DVec2>, Faces) {
    // (origin, one side, the other): their cross product points outwards.
    let side = [
        (DVec3::ZERO, DVec3::Y * 200.0, DVec3::X * 100.0),
        (DVec3::ZERO, DVec3::X * 100.0, DVec3::Z * 100.0),
        (DVec3::Y * 200.0, DVec3::Z * 100.0, DVec3::X * 100.0),
        (DVec3::ZERO, DVec3::Z * 100.0, DVec3::Y * 200.0),
        (DVec3::X * 100.0, DVec3::Y * 200.0, DVec3::Z * 100.0),
    ];
    let (mut vertices, mut uv, mut faces) = (vec![], vec![], vec![]);
    for (k, (origin, a, b)) in side.into_iter().enumerate() {
        let n = vertices.len();
        vertices.extend([origin, origin + a, origin + a + b, origin + b]);
        let left = 0.2 * k as f64;
        uv.extend([(0.01, 0.0), (0.19, 0.0), (0.19, 0.5), (0.01, 0.5)].map(|(u, v)| DVec2::new(left + u, v)));
        faces.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }
    (vertices, uv, faces)
}

fn of_mesh(vertices: Vec<DVec3>, uv: Vec<DVec2>, faces: Vec<[usize; 3]>) -> Result<Template, TemplateError> {
    let mesh = TriangleMesh::new(vertices, uv, faces)?;
    Template::of_mesh(mesh, Picture::from_fn(2, 2, |_, _| [0; 3]))
}

#[test]
fn a_mesh_template_knows_its_charts_its_scale_and_the_point_under_a_texel() {
    let (vertices, uv, faces) = open_box();
    let template = of_mesh(vertices, uv, faces).unwrap();
    assert!(!template.is_sheet());
    assert_eq!(template.extent_mm(), DVec3::new(100.0, 200.0, 100.0));
    let topology = Topology::of(template.mesh()).unwrap();
    assert_eq!((topology.charts, topology.seam_edges, topology.border_edges), (5, 8, 4));
    // The third side: from (0, 200, 0), u along z (100 mm on 0.18), v along x (100 mm on 0.5).
    let p = template.point_template(DVec2::new(0.4 + 0.01 + 0.045, 0.125)).unwrap();
    assert!(p.distance(DVec3::new(25.0, 200.0, 25.0)) < 1e-9, "{p}");
    assert_eq!(template.point_template(DVec2::new(0.1, 0.7)), None);
    // Of 8 equal areas 4 have 100 mm on the 0.18 of u and 4 have 200 mm; of the 0.5 of v 6 have 100 mm.
    let expected = DVec2::new(100.0 / 0.18, 100.0 / 0.5);
    assert!(
        template.size_mm().distance(expected) < 1e-6,
        "{} {expected}",
        template.size_mm()
    );
    // A face of 2 square millimetres that is nearly a line in the texture changes nothing.
    let (mut vertices, mut uv, mut faces) = open_box();
    let n = vertices.len();
    vertices.extend([0.0, 2.0, 4.0].map(|x| DVec3::new(x, -x * x / 2.0, 50.0)));
    uv.extend([(0.0, 0.6), (0.1, 0.6), (0.2, 0.6 + 1e-6)].map(|(u, v)| DVec2::new(u, v)));
    faces.push([n, n + 1, n + 2]);
    let scanned = of_mesh(vertices, uv, faces).unwrap();
    assert!(scanned.size_mm().distance(expected) < 1e-6, "{}", scanned.size_mm());
}

#[test]
fn what_cannot_be_deformed_or_registered_is_refused_with_its_place() {
    let refused = |change: Change<'_>| {
        let (mut vertices, mut uv, mut faces) = open_box();
        change(&mut vertices, &mut uv, &mut faces);
        of_mesh(vertices, uv, faces).unwrap_err()
    };
    assert_eq!(refused(&|_, _, faces| faces.clear()), TemplateError::MeshWithoutFaces);
    assert_eq!(
        refused(&|_, _, faces| faces[3] = [4, 4, 6]),
        TemplateError::DegenerateFace(3)
    );
    assert_eq!(
        refused(&|vertices, uv, _| {
            vertices.push(DVec3::ONE);
            uv.push(DVec2::ZERO);
        }),
        TemplateError::UnusedVertex(20)
    );
    assert!(matches!(
        refused(&|_, uv, _| uv[7].y = 1.25),
        TemplateError::TextureOutside(7, _)
    ));
    assert!(matches!(
        refused(&|_, _, faces| faces[5].swap(0, 1)),
        TemplateError::FaceOrientation(_, 5)
    ));
    // The fifth chart on the first: a quarter of what is used is shared.
    let overlap = refused(&|_, uv, _| (0..4).for_each(|k| uv[16 + k] = uv[k]));
    assert!(
        matches!(overlap, TemplateError::ChartsOverlap(percent) if (percent - 25.0).abs() < 1.0),
        "{overlap}"
    );
}

#[test]
fn what_needs_a_grid_says_so() {
    let (vertices, uv, faces) = open_box();
    let template = of_mesh(vertices, uv, faces).unwrap();
    let refused = [
        template.finer().err(),
        SelfCalibration::new(&template, Default::default()).err(),
    ];
    for error in refused {
        assert!(matches!(error, Some(GeometryError::NotASheet(_))), "{error:?}");
    }
}
