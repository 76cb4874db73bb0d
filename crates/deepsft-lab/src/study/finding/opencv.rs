//! OpenCV's ORB and SIFT: a Python process matches and warps, our coarse mesh bends to its matches.

use super::finders::{Finder, Found, View};
use crate::measuring::{Process, Stopwatch};
use anyhow::{Context, Result, ensure};
use deepsft_finding::{FeatureFinder, Features, Match, PictureTarget};
use deepsft_formats::write_file;
use deepsft_geometry::glam::{DVec2, Vec2};
use deepsft_geometry::{Picture, Template};
use serde::Deserialize;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const SCRIPT: &str = include_str!("../../../../xtask/bench/opencv_matches.py");

const DOES_NOT_RUN: &str =
    "OpenCV does not run; install crates/xtask/bench/requirements-finding.txt for the Python of --opencv";

/// Nodes of the warp along x.
const COLUMNS: usize = 7;

#[derive(Clone, Copy)]
pub enum Method {
    Orb,
    Sift,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Orb => "OpenCV ORB",
            Self::Sift => "OpenCV SIFT",
        }
    }

    fn argument(self) -> &'static str {
        match self {
            Self::Orb => "ORB",
            Self::Sift => "SIFT",
        }
    }
}

/// One of OpenCV's methods with the mesh that takes its matches on.
pub struct OpenCv {
    method: Method,
    // Dropped before the folder.
    process: Process,
    folder: TempDir,
    mesh: Option<FeatureFinder>,
}

/// What the script answers.
#[derive(Deserialize)]
struct Answer {
    #[serde(default)]
    matches: Vec<[f32; 6]>,
    warp: Option<Warp>,
    milliseconds: f64,
}

/// A bilinear map from pixels to places on the print, mm.
#[derive(Deserialize)]
struct Warp {
    low: [f64; 2],
    cell: [f64; 2],
    nodes: Vec<[f64; 2]>,
}

impl Warp {
    fn place(&self, pixel: DVec2) -> DVec2 {
        let last = DVec2::new(COLUMNS as f64 - 2.0, (self.nodes.len() / COLUMNS) as f64 - 2.0);
        let at = (pixel - DVec2::from(self.low)) / DVec2::from(self.cell);
        let first = at.floor().clamp(DVec2::ZERO, last);
        let (t, node) = (at - first, first.y as usize * COLUMNS + first.x as usize);
        let at = |offset: usize| DVec2::from(self.nodes[node + offset]);
        let (top, bottom) = (at(0).lerp(at(1), t.x), at(COLUMNS).lerp(at(COLUMNS + 1), t.x));
        top.lerp(bottom, t.y)
    }
}

impl OpenCv {
    pub fn start(python: &Path, method: Method) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let script = folder.path().join("opencv_matches.py");
        write_file(&script, SCRIPT.as_bytes())?;
        let mut command = Command::new(python);
        let process = Process::start(command.arg("-B").arg(script).arg(method.argument()), 1)?;
        Ok(Self {
            method,
            process,
            folder,
            mesh: None,
        })
    }

    /// Sends a picture; `what` it is and what else there is to say.
    fn send(&mut self, what: &str, picture: &Picture, rest: serde_json::Value) -> Result<()> {
        let file = self.folder.path().join(format!("{what}.rgb"));
        write_file(&file, picture.rgb())?;
        let mut request = serde_json::json!({ "width": picture.width(), "height": picture.height(), "rest": rest });
        request[what] = file.to_string_lossy().into();
        self.process.tell(&request.to_string()).context(DOES_NOT_RUN)
    }

    fn answer(&mut self) -> Result<Answer> {
        let line = self.process.answer().context(DOES_NOT_RUN)?;
        serde_json::from_str(&line).context("reading what opencv_matches.py answered")
    }
}

impl Finder for OpenCv {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn is_ours(&self) -> bool {
        false
    }

    fn take(&mut self, template: &Template) -> Result<()> {
        let size = template.size_mm().to_array();
        self.send("target", template.texture(), size.as_slice().into())?;
        self.mesh = Some(FeatureFinder::new(PictureTarget::from_template(template.clone())?)?);
        self.answer()?;
        Ok(())
    }

    fn begin(&mut self, image: &Picture) -> Result<()> {
        self.send("frame", image, serde_json::Value::Null)
    }

    fn find(&mut self, view: View<'_>) -> Result<Found> {
        let answer = self.answer()?;
        let mesh = self.mesh.as_mut().context("there is no print to look for")?;
        let start = Stopwatch::start();
        let candidates: Vec<Match> = (answer.matches.iter())
            .map(|&[x, y, place_x, place_y, angle, scale]| Match {
                pixel: Vec2::new(x, y),
                place: Vec2::new(place_x, place_y),
                angle,
                scale,
            })
            .collect();
        let found = mesh.find_among(&candidates, &Features::default(), view.camera, view.canonical)?;
        if let Some(warp) = &answer.warp {
            ensure!(
                warp.nodes.len() > COLUMNS && warp.nodes.len() % COLUMNS == 0,
                "a warp of odd nodes"
            );
        }
        let warp = answer.warp;
        Ok(Found {
            maps: found.map(|found| found.maps),
            warp: warp.map(|warp| Box::new(move |pixel| warp.place(pixel)) as _),
            features_ms: answer.milliseconds,
            find_ms: start.ms(),
            ..Found::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warp_goes_through_its_nodes_and_on_beyond_them() {
        let place = |p: DVec2| DVec2::new(3.0 + 0.2 * p.x - 0.1 * p.y, 7.0 + 0.4 * p.y + 0.001 * p.x * p.y);
        let (low, cell) = (DVec2::new(20.0, -10.0), DVec2::new(50.0, 40.0));
        let node = |k: usize| low + cell * DVec2::new((k % COLUMNS) as f64, (k / COLUMNS) as f64);
        let warp = Warp {
            low: low.into(),
            cell: cell.into(),
            nodes: (0..35).map(|k| place(node(k)).into()).collect(),
        };
        for pixel in [node(0), node(34), DVec2::new(133.0, 71.0), DVec2::new(-40.0, 300.0)] {
            assert!(warp.place(pixel).distance(place(pixel)) < 1e-9, "{pixel}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_python_without_opencv_is_told_what_to_install() {
        let mut opencv = OpenCv::start(Path::new("false"), Method::Orb).unwrap();
        let template = Template::thin_shell(Picture::from_fn(9, 9, |_, _| [0; 3]), 100.0, 100.0).unwrap();
        let error = format!("{:#}", opencv.take(&template).unwrap_err());
        assert!(error.contains("requirements-finding.txt"), "{error}");
    }
}
