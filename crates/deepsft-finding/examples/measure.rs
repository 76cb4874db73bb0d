//! Measures the finder on synthetic frames of prints.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_finding::{FeatureFinder, Features, PictureTarget};
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::{CanonicalWarp, Maps, Picture, Template, training_camera};
use deepsft_synth::{SynthConfig, Synthesizer};
use std::path::Path;
use std::time::Instant;

/// Median distance over the visible sheet between two registrations, as pixels of the canonical image.
fn error_px(truth: &Maps, found: &Maps, template: &Template, focal: f64) -> f64 {
    let size = template.size_mm();
    let mut errors: Vec<f64> = (0..truth.depth().len())
        .filter(|&p| truth.inside(p))
        .map(|p| {
            if !found.inside(p) {
                return 1e3;
            }
            ((truth.uv(p) - found.uv(p)) * size).length() * focal / f64::from(truth.depth()[p])
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
}

fn prints(folder: &str, count: usize) -> Vec<(String, Picture)> {
    let mut prints = Vec::new();
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    for file in files.iter().skip(1).step_by((files.len() / count.max(1)).max(1)).take(count) {
        let bytes = std::fs::read(Path::new(file)).unwrap();
        prints.push(("photograph".to_owned(), deepsft_formats::decode_picture(&bytes).unwrap()));
    }
    for number in 0..2 * count {
        prints.push(deepsft_synth::painting::named_artwork(number, 777 + number as u64));
    }
    prints
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let (folder, count, frames) = (&arguments[1], arguments[2].parse().unwrap(), arguments[3].parse::<u64>().unwrap());
    let canonical = training_camera();
    let camera = canonical.resized(960, 540).unwrap();
    let mut rows: Vec<(String, f64, f64, f64, usize)> = Vec::new();
    let (mut find_ms, mut feature_ms, mut compile_ms) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (kind, picture)) in prints(folder, count).into_iter().enumerate() {
        let (w, h) = (picture.width() as f64, picture.height() as f64);
        let scale = 297.0 / w.max(h);
        let template = Template::thin_shell(picture, w * scale, h * scale).unwrap();
        let mut config = SynthConfig::default();
        config.camera = camera;
        config.empty_probability = 0.0;
        config.least_visible_px = 4 * 1500;
        let synthesizer = Synthesizer::new(&template, config).unwrap();
        let start = Instant::now();
        let target = PictureTarget::new(template.clone()).unwrap();
        compile_ms.push(start.elapsed().as_secs_f64() * 1e3);
        let mut finder = FeatureFinder::new(target).unwrap();
        let mut fitter = FrameFitter::new(&template, FitOptions::default()).unwrap();
        for frame in 0..frames {
            let sample = synthesizer.sample(900 + k as u64, frame);
            let start = Instant::now();
            let (image, image_camera) = FeatureFinder::prepared(&sample.image, &camera).unwrap();
            let features = Features::of(&image, &FeatureFinder::options());
            feature_ms.push(start.elapsed().as_secs_f64() * 1e3);
            let start = Instant::now();
            let found = finder.find(&features, &image_camera, &canonical).unwrap();
            find_ms.push(start.elapsed().as_secs_f64() * 1e3);
            // The truth at half the size.
            let mut truth = Maps::empty(480, 270);
            for p in 0..480 * 270 {
                let q = (p / 480 * 2) * 960 + p % 480 * 2;
                if sample.truth.inside(q) {
                    truth.set(p, sample.truth.depth()[q], sample.truth.registration()[q]);
                }
            }
            let (mut first, mut fitted, mut agreement, mut inliers) = (1e3, 1e3, 0.0, 0);
            if let Some(found) = &found {
                inliers = found.inliers;
                first = error_px(&truth, &found.maps, &template, 380.0);
                let small = CanonicalWarp::new(&camera, &canonical).apply(&sample.image).unwrap();
                if let Some(fit) = fitter.fit(&small, &canonical, &found.maps, None).unwrap() {
                    fitted = error_px(&truth, &fit.maps, &template, 380.0);
                    agreement = fit.agreement;
                }
            }
            let right = |stage: &[([f32; 2], [f32; 2])]| {
                let size = template.size_mm().as_vec2();
                let near = stage.iter().filter(|(pixel, place)| {
                    let p = pixel[1] as usize * 960 + pixel[0] as usize;
                    let [u, v] = sample.truth.registration()[p];
                    sample.truth.inside(p) && (u * size.x - place[0]).hypot(v * size.y - place[1]) < 12.0
                });
                format!("{}/{}", near.count(), stage.len())
            };
            if let Some(found) = &found {
                print!("[{} {}; seen {}] ", right(&found.stages[0]), right(&found.stages[1]), truth.area());
            }
            println!("{k} {kind} {frame}: {} features, {inliers} inliers, {first:.2} px, fitted {fitted:.2} px, agreement {agreement:.2}", features.len());
            rows.push((kind.clone(), first, fitted, agreement, inliers));
        }
    }
    let median = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let mut kinds: Vec<String> = rows.iter().map(|r| r.0.clone()).collect();
    kinds.sort();
    kinds.dedup();
    kinds.push("all".to_owned());
    for kind in kinds {
        let of: Vec<_> = rows.iter().filter(|r| kind == "all" || r.0 == kind).collect();
        let part = |f: &dyn Fn(&&(String, f64, f64, f64, usize)) -> bool| {
            100.0 * of.iter().filter(|r| f(r)).count() as f64 / of.len() as f64
        };
        println!(
            "SUM {kind:18} {:4} frames: within 8 px {:5.1} %, 4 px {:5.1} %; fitted within 2 px {:5.1} %, 1 px {:5.1} %; agreement > 0.6 {:5.1} %, of these wrong {:5.1} %",
            of.len(),
            part(&|r| r.1 < 8.0),
            part(&|r| r.1 < 4.0),
            part(&|r| r.2 < 2.0),
            part(&|r| r.2 < 1.0),
            part(&|r| r.3 > 0.6),
            part(&|r| r.3 > 0.6 && r.2 > 2.0),
        );
    }
    println!(
        "SUM features {:.1} ms, find {:.1} ms, compile {:.1} ms",
        median(&mut feature_ms),
        median(&mut find_ms),
        median(&mut compile_ms)
    );
}
