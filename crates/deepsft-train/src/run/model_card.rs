//! What a bundle tells people: `CARD.md`, and the training curve as a table.

use super::CurvePoint;
use deepsft::{DeviceDescription, ModelBundle};
use deepsft_geometry::Template;

/// Name of the card in a bundle.
pub const CARD_FILE: &str = "CARD.md";

/// Name of the training curve in a bundle.
pub const CURVE_FILE: &str = "curve.csv";

/// How a bundle came about, beside what it says itself.
#[derive(Debug)]
pub struct TrainingCourse<'a> {
    /// What computed.
    pub device: &'a DeviceDescription,
    /// The images of step 1, if it was made.
    pub training_images: Option<String>,
    /// The curve of step 1, if the same command made it; else empty.
    pub curve: &'a [CurvePoint],
    /// The table of steps 2 and 3, if they were made.
    pub tuning: Option<&'a str>,
    /// Settings of the measured images that are not the default, in words and as options of `deepsft`.
    pub measured_images: [String; 2],
}

/// The card: what the model is for, how it came about, how good it is.
pub fn model_card(bundle: &ModelBundle, course: &TrainingCourse<'_>) -> String {
    let (device, curve, [note, options]) = (course.device, course.curve, &course.measured_images);
    let (card, camera) = (bundle.card(), bundle.camera());
    let (provenance, accuracy) = (&card.provenance, &card.accuracy);
    let figure = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |value| format!("{value:.2}"));
    let first_and_last: String = curve
        .first()
        .into_iter()
        .chain(curve.last().filter(|_| curve.len() > 1))
        .map(row)
        .collect();
    let step_one = if curve.is_empty() {
        String::new()
    } else {
        format!(
            "\
![Accuracy against samples seen](curve.png)

`{CURVE_FILE}` is the whole curve of step 1, measured on held-out synthetic images; its ends are

| samples | hours | loss | registration px | depth mm | mask IoU |
|---|---|---|---|---|---|
{first_and_last}
"
        )
    };
    let recording_steps = course.tuning.map_or_else(String::new, |table| {
        format!("{table}\nThe curves of the steps are `step-2.csv` and `step-3.csv`, as far as they were made.\n\n")
    });
    format!(
        "\
# {name}

Finds one {object} in an image and measures it: depth,
registration to the template and mask, on a canonical image of {pixels_x} x {pixels_y} pixels with f = {focal}.
It knows no other object.

## How it came about

{origin}, with deepsft {version}:

    {command}

| | |
|---|---|
| seed | {seed} |
{training_images}| training samples | {samples} |
| hours | {hours:.2} |
| device | {kind}: {adapter} |

{step_one}{recording_steps}## Accuracy

On {frames} held-out synthetic images made on the fly{note}: registration RMSE {px} px of the canonical image and depth RMSE
{mm} mm (medians over the images that show the {kind_of_object}), mask IoU {iou} (mean). Measure it again, on more:

    deepsft eval --model BUNDLE --synthetic 500 --seed 999{options}

A frame counts as showing the {kind_of_object} when its mask covers at least {area:.1} % of it and the template, seen
through the registration, agrees with the image by at least {confidence:.2} (0: not at all, 1: fully).

## Licence

{licence}
",
        name = card.name,
        object = object(bundle.template()),
        kind_of_object = if bundle.template().is_sheet() { "sheet" } else { "object" },
        pixels_x = camera.size().width,
        pixels_y = camera.size().height,
        focal = camera.focal().x,
        version = provenance.deepsft_version,
        command = provenance.command,
        origin = match (&course.training_images, course.tuning) {
            (Some(_), Some(_)) => "Trained on synthetic images and tuned on an RGB-D recording (the steps of the paper)",
            (None, Some(_)) => "Tuned on an RGB-D recording (steps 2 and 3 of the paper)",
            (_, None) => "Trained on synthetic images alone",
        },
        seed = provenance.seed,
        training_images = course
            .training_images
            .as_ref()
            .map(|images| format!("| training images | {images} |\n"))
            .unwrap_or_default(),
        samples = provenance.samples,
        hours = provenance.seconds / 3600.0,
        kind = device.kind,
        adapter = device.adapter_name,
        frames = accuracy.frames,
        px = figure(accuracy.registration_rmse_px),
        mm = figure(accuracy.depth_rmse_mm),
        iou = figure(accuracy.mask_iou),
        area = 100.0 * card.found.min_area,
        confidence = card.found.min_confidence,
        licence = card.licence.as_deref().unwrap_or("Not stated."),
    )
}

/// What a template is of.
fn object(template: &Template) -> String {
    if template.is_sheet() {
        let size = template.size_mm();
        return format!("thin sheet of {} x {} mm (`template/texture.png`)", size.x, size.y);
    }
    let (extent, mesh) = (template.extent_mm(), template.mesh());
    format!(
        "object of {:.0} x {:.0} x {:.0} mm at rest, a textured mesh of {} faces (`template/`),",
        extent.x,
        extent.y,
        extent.z,
        mesh.faces().len()
    )
}

fn row(point: &CurvePoint) -> String {
    let figure = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
    format!(
        "| {} | {:.2} | {} | {} | {} | {} |\n",
        point.samples,
        point.seconds / 3600.0,
        figure(measured_loss(point), 3),
        figure(point.registration_rmse_px, 2),
        figure(point.depth_rmse_mm, 2),
        figure(point.mask_iou, 2),
    )
}

/// The loss where it was measured, see [`CurvePoint::loss`].
fn measured_loss(point: &CurvePoint) -> Option<f64> {
    Some(point.loss).filter(|loss| !loss.is_nan())
}

/// The curve as comma-separated values with a line of names; a figure that no image has is left empty.
pub fn curve_csv(curve: &[CurvePoint]) -> String {
    let mut csv =
        "samples,seconds,loss,learning_rate,registration_rmse_px,depth_rmse_mm,mask_iou,photo_consistency_error\n"
            .to_owned();
    for point in curve {
        let figure = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
        let cells = [
            point.samples.to_string(),
            point.seconds.to_string(),
            figure(measured_loss(point)),
            point.learning_rate.to_string(),
            figure(point.registration_rmse_px),
            figure(point.depth_rmse_mm),
            figure(point.mask_iou),
            figure(point.photo_consistency_error),
        ];
        csv.push_str(&cells.join(","));
        csv.push('\n');
    }
    csv
}
