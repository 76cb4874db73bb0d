//! A template from several sides, for a look at whether it is right and from where it is found without training.

use super::canvas::Canvas;
use super::lettering::{Align, Lettering};
use anyhow::Result;
use deepsft::features::{FeatureFinder, SolidGrade, solid_sides};
use deepsft::{encode_png, template_to_files};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Picture, Template};
use deepsft_synth::{SynthConfig, Synthesizer};
use std::path::Path;

/// Name of the picture in a template's folder.
pub const TURNTABLE_FILE: &str = "views.png";

/// Side of a view, pixels.
const SIDE: usize = 360;

/// Distance of the camera in radii of the object.
const RADII: f64 = 4.0;

/// Nothing nearer than this is drawn, mm, with room.
const NEAR_MM: f64 = 60.0;

/// `template` from the front, its left, the back, its right, above and below, under even light, and how it is found from there.
pub fn turntable(template: &Template, grade: Option<&SolidGrade>) -> Result<Picture> {
    let radius = template.extent_mm().length() / 2.0;
    let distance = RADII * radius + NEAR_MM;
    let side = SIDE as f64;
    let focal = 0.47 * side * distance / radius;
    let camera = Camera::pinhole((SIDE, SIDE), DVec2::splat(focal), DVec2::splat(side / 2.0))?;
    let config = SynthConfig {
        camera,
        ..SynthConfig::default()
    };
    let synthesizer = Synthesizer::new(template, config)?;
    let mut canvas = Canvas::new(3 * SIDE, 2 * SIDE, [0; 3]);
    for (number, (name, turn)) in solid_sides().into_iter().enumerate() {
        let place = |p: &DVec3| turn * *p + distance * DVec3::Z;
        let view = synthesizer.render_clean(template.mesh().vertices().iter().map(place).collect())?;
        let (left, top) = (number % 3 * SIDE, number / 3 * SIDE);
        canvas.draw(&view.image, left, top);
        let corner = (left as f64 + 12.0, top as f64 + 18.0);
        let name = name.trim_start_matches("the ");
        canvas.write(name, corner, Align::Left, Lettering::semibold(16.0, [255; 3]));
        if let Some(grade) = grade {
            let found = format!("found in {:.0} % of views", 100.0 * grade.sides[number].1);
            let below = (corner.0, corner.1 + 20.0);
            canvas.write(&found, below, Align::Left, Lettering::semibold(14.0, [180; 3]));
        }
    }
    Ok(canvas.into_picture())
}

/// Writes a template that is no sheet into the folder `out`, with a picture of it from several sides.
pub fn write_template(out: &Path, template: &Template) -> Result<()> {
    let mut files = template_to_files(template)?;
    // A solid of a size that no object has is not looked for.
    let grade = FeatureFinder::new(template.clone())
        .and_then(|mut finder| finder.grade_solid())
        .ok();
    files.insert(
        TURNTABLE_FILE.to_owned(),
        encode_png(&turntable(template, grade.as_ref())?)?,
    );
    deepsft_formats::write_folder(out, &deepsft_formats::FolderKind::TEMPLATE, &files)?;
    let [x, y, z] = template.extent_mm().into();
    let (faces, texels) = (template.mesh().faces().len(), template.texture().size());
    println!(
        "template of {x:.1} x {y:.1} x {z:.1} mm with {faces} faces and {texels} texels: {}",
        out.display()
    );
    if let Some(grade) = grade {
        let sides = grade
            .sides
            .map(|(name, found)| format!("{name} {:.0} %", 100.0 * found));
        println!(
            "found without training, by drawn views: {}: {}",
            grade.level.name(),
            sides.join(", ")
        );
        if let Some(advice) = grade.advice {
            println!("{advice}");
        }
    }
    println!("look at it: {}", out.join(TURNTABLE_FILE).display());
    Ok(())
}
