//! The folder of a track, written frame by frame.

use super::report::{self, Report};
use anyhow::{Context, Result};
use deepsft_formats::{FolderKind, StagedFolder, unfinished_folder};
use deepsft_geometry::glam::DVec3;
use deepsft_synth::frame_name;
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Name of the report, by which a folder of results is known.
const TRACK_FILE: &str = "track.json";
const VERTICES_FILE: &str = "vertices.npy";

/// The folder of a track.
pub const TRACK_FOLDER: FolderKind = FolderKind {
    known_by: &[TRACK_FILE],
    files: &[
        TRACK_FILE,
        "track.csv",
        VERTICES_FILE,
        "flat.png",
        "flat-confidence.png",
        "meshes/frame-#.glb",
        "pictures/frame-#.png",
    ],
};

/// Files of a track, written beside their place while the video lasts. Dropped before [`TrackFolder::commit`], nothing of
/// them stays.
pub struct TrackFolder {
    place: PathBuf,
    folder: StagedFolder,
    vertices: BufWriter<File>,
    /// Copies of the object and vertices of each.
    copies: usize,
    vertices_per_copy: usize,
}

impl TrackFolder {
    /// Begins the folder that is to stand at `path`, for so many copies of a mesh of so many vertices. Until it is committed no other process can begin it.
    pub fn new(path: &Path, copies: usize, vertices_per_copy: usize) -> Result<Self> {
        if is_whole(path) {
            // There the frames are kept if the video ends early.
            deepsft_formats::check_folder(&unfinished_folder(path), &TRACK_FOLDER)?;
        }
        let folder = StagedFolder::new(path, &TRACK_FOLDER)?;
        let create = || -> std::io::Result<_> {
            let mut vertices = BufWriter::new(File::create(folder.path().join(VERTICES_FILE))?);
            vertices.write_all(&deepsft_formats::f32_npy_header(&shape(0, copies, vertices_per_copy)))?;
            Ok(vertices)
        };
        let vertices = create().with_context(|| unwritten(path))?;
        Ok(Self {
            place: path.to_path_buf(),
            folder,
            vertices,
            copies,
            vertices_per_copy,
        })
    }

    /// Adds the vertices of a frame: those of each copy, `None` of one that was not found.
    pub fn add<'a>(&mut self, vertices_camera: impl IntoIterator<Item = Option<&'a [DVec3]>>) -> Result<()> {
        let nowhere = vec![DVec3::NAN; self.vertices_per_copy];
        let vertices = vertices_camera.into_iter().flat_map(|copy| copy.unwrap_or(&nowhere));
        let values = vertices.flat_map(|p| p.as_vec3().to_array());
        let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
        self.vertices.write_all(&bytes).with_context(|| unwritten(&self.place))
    }

    /// Writes a file of the whole track.
    pub fn write_whole(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(self.folder.write(name, bytes)?)
    }

    /// Writes a file of the frame `number` into the folder `kind`.
    pub fn write(&self, kind: &str, number: usize, ending: &str, bytes: &[u8]) -> Result<()> {
        self.write_whole(&format!("{kind}/{}", frame_name(number, ending)), bytes)
    }

    /// Writes the report and puts the folder in its place, which is returned: beside an older track that is whole if this one
    /// is not.
    pub fn commit(mut self, report: &Report) -> Result<PathBuf> {
        let frames = report.frames;
        // What the disk took of a frame before it was full goes.
        for (kind, ending) in [("pictures", "png"), ("meshes", "glb")] {
            let _ = fs::remove_file(self.folder.path().join(kind).join(frame_name(frames, ending)));
        }
        let mut finish = || -> std::io::Result<()> {
            // The number of frames is known only now; the header has the same length whatever it is.
            self.vertices.seek(SeekFrom::Start(0))?;
            let shape = shape(frames, self.copies, self.vertices_per_copy);
            let header = deepsft_formats::f32_npy_header(&shape);
            self.vertices.write_all(&header)?;
            self.vertices.flush()?;
            let bytes = header.len() + shape.iter().product::<usize>() * size_of::<f32>();
            self.vertices.get_ref().set_len(bytes as u64)?;
            self.vertices.get_ref().sync_all()
        };
        finish().with_context(|| unwritten(&self.place))?;
        let rows = report.per_frame.iter().map(report::table_row);
        let table = report::TABLE_HEADER.to_owned() + &rows.collect::<String>();
        self.write_whole("track.csv", table.as_bytes())?;
        self.write_whole(TRACK_FILE, &serde_json::to_vec_pretty(report)?)?;
        let place = match report.ended_early {
            Some(_) if is_whole(&self.place) => unfinished_folder(&self.place),
            _ => self.place,
        };
        self.folder.commit_to(&place)?;
        if report.ended_early.is_none() {
            remove_track(&unfinished_folder(&place))?;
        }
        Ok(place)
    }
}

/// The shape of `vertices.npy`.
fn shape(frames: usize, copies: usize, vertices: usize) -> Vec<usize> {
    match copies {
        1 => vec![frames, vertices, 3],
        _ => vec![frames, copies, vertices, 3],
    }
}

/// What could not be done, for people.
fn unwritten(place: &Path) -> String {
    format!("could not write {}", place.display())
}

/// Removes the track in `folder`, if there is one; files that are not of a track stay.
fn remove_track(folder: &Path) -> Result<()> {
    if folder.join(TRACK_FILE).is_file() {
        // In its place comes a track without files.
        StagedFolder::new(folder, &TRACK_FOLDER)?.commit()?;
        // This fails, as it should, where other files are left.
        let _ = fs::remove_dir(folder);
    }
    Ok(())
}

/// Whether there is a track in `folder` that has all frames of its video, as far as can be told.
fn is_whole(folder: &Path) -> bool {
    fs::read(folder.join(TRACK_FILE)).is_ok_and(|report| {
        let report: Value = serde_json::from_slice(&report).unwrap_or_default();
        report.get("ended_early").is_none()
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_header_of_the_vertices_has_one_length_for_any_number_of_frames() {
        for vertices in [4, 1271, 10_000_000] {
            let length = |frames| deepsft_formats::f32_npy_header(&[frames, vertices, 3]).len();
            assert_eq!(length(0), length(usize::MAX));
        }
    }
}
