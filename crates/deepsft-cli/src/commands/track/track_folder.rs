//! The folder of a track, written frame by frame.

use super::report::{self, FrameReport, Report};
use crate::paths::beside;
use anyhow::{Context, Result};
use deepsft_formats::{FolderKind, StagedFolder};
use deepsft_geometry::glam::DVec3;
use deepsft_synth::frame_name;
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Name of the report, by which a folder of results is known.
const TRACK_FILE: &str = "track.json";

/// The folder of a track.
pub const TRACK_FOLDER: FolderKind = FolderKind {
    known_by: &[TRACK_FILE],
    files: &[
        TRACK_FILE,
        "track.csv",
        "vertices.npy",
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
    table: BufWriter<File>,
    vertices: BufWriter<File>,
    /// Copies of the object and vertices of each.
    copies: usize,
    vertices_per_copy: usize,
    /// Frames that are in table and vertices, and the length of the table with them, bytes.
    frames: usize,
    table_bytes: u64,
}

impl TrackFolder {
    /// Begins the folder that is to stand at `path`, for so many copies of a mesh of so many vertices. Until it is committed no other process can begin it.
    pub fn new(path: &Path, copies: usize, vertices_per_copy: usize) -> Result<Self> {
        if is_whole(path) {
            // There the frames are kept if the video ends early.
            deepsft_formats::check_folder(&partial(path), &TRACK_FOLDER)?;
        }
        let folder = StagedFolder::new(path, &TRACK_FOLDER)?;
        let create = |name: &str| {
            let file = File::create(folder.path().join(name)).with_context(|| unwritten(path));
            file.map(BufWriter::new)
        };
        let (mut table, mut vertices) = (create("track.csv")?, create("vertices.npy")?);
        table
            .write_all(report::TABLE_HEADER.as_bytes())
            .and_then(|()| vertices.write_all(&deepsft_formats::f32_npy_header(&shape(0, copies, vertices_per_copy))))
            .with_context(|| unwritten(path))?;
        Ok(Self {
            place: path.to_path_buf(),
            folder,
            table,
            vertices,
            copies,
            vertices_per_copy,
            frames: 0,
            table_bytes: report::TABLE_HEADER.len() as u64,
        })
    }

    /// Adds a frame to table and vertices: those of each copy, `None` of one that was not found.
    pub fn add<'a>(
        &mut self,
        frame: &FrameReport,
        vertices_camera: impl IntoIterator<Item = Option<&'a [DVec3]>>,
    ) -> Result<()> {
        let row = report::table_row(frame);
        let write = || -> Result<()> {
            self.table.write_all(row.as_bytes())?;
            for copy in vertices_camera {
                match copy {
                    Some(vertices) => {
                        for value in vertices.iter().flat_map(|p| p.as_vec3().to_array()) {
                            self.vertices.write_all(&value.to_le_bytes())?;
                        }
                    }
                    None => {
                        for _ in 0..3 * self.vertices_per_copy {
                            self.vertices.write_all(&f32::NAN.to_le_bytes())?;
                        }
                    }
                }
            }
            Ok(())
        };
        write().with_context(|| unwritten(&self.place))?;
        self.frames += 1;
        self.table_bytes += row.len() as u64;
        Ok(())
    }

    /// Writes a file of the whole track.
    pub fn write_whole(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(deepsft_formats::write_file(&self.folder.path().join(name), bytes)?)
    }

    /// Writes a file of the frame `number` into the folder `kind`.
    pub fn write(&self, kind: &str, number: usize, ending: &str, bytes: &[u8]) -> Result<()> {
        let folder = self.folder.path().join(kind);
        fs::create_dir_all(&folder).with_context(|| unwritten(&self.place))?;
        Ok(deepsft_formats::write_file(
            &folder.join(frame_name(number, ending)),
            bytes,
        )?)
    }

    /// Writes the report and puts the folder in its place, which is returned: beside an older track that is whole if this one
    /// is not.
    pub fn commit(mut self, report: &Report) -> Result<PathBuf> {
        // What the disk took of a frame before it was full goes.
        for (kind, ending) in [("pictures", "png"), ("meshes", "glb")] {
            let _ = fs::remove_file(self.folder.path().join(kind).join(frame_name(self.frames, ending)));
        }
        let mut finish = || -> Result<()> {
            self.table.flush()?;
            self.table.get_ref().set_len(self.table_bytes)?;
            self.table.get_ref().sync_all()?;
            // The number of frames is known only now; the header has the same length whatever it is.
            self.vertices.seek(SeekFrom::Start(0))?;
            let shape = shape(self.frames, self.copies, self.vertices_per_copy);
            let header = deepsft_formats::f32_npy_header(&shape);
            self.vertices.write_all(&header)?;
            self.vertices.flush()?;
            let values: usize = shape.iter().product();
            let bytes = header.len() + values * size_of::<f32>();
            self.vertices.get_ref().set_len(bytes as u64)?;
            Ok(self.vertices.get_ref().sync_all()?)
        };
        finish().with_context(|| unwritten(&self.place))?;
        let path = self.folder.path().join(TRACK_FILE);
        deepsft_formats::write_file(&path, &serde_json::to_vec_pretty(report)?)?;
        let place = match report.ended_early {
            Some(_) if is_whole(&self.place) => partial(&self.place),
            _ => self.place,
        };
        self.folder.commit_to(&place)?;
        if report.ended_early.is_none() {
            remove_track(&partial(&place))?;
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

/// Where a track that ends early is put if the one at `place` is whole.
fn partial(place: &Path) -> PathBuf {
    beside(place, ".partial")
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
