//! Videos: a folder of images, a `.y4m` file, or anything that the program ffmpeg reads.

mod yuv4mpeg;

use crate::failure::BlameInput;
use crate::input;
use anyhow::{Context, Result, bail};
use deepsft_geometry::Picture;
use std::ffi::OsString;
use std::fs;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;

pub use yuv4mpeg::Yuv4Mpeg;

/// Complaints of ffmpeg that an error quotes.
const MAX_COMPLAINTS: usize = 3;

/// Frames per second of a folder of images, unless they are given.
const TYPICAL_RATE: f64 = 30.0;

/// A video that is read frame by frame.
pub struct Video {
    /// Frames per second.
    pub frames_per_s: f64,
    /// Number of frames, where it is known beforehand.
    pub count: Option<u64>,
    /// The frames in order; they end with the first error.
    pub frames: Box<dyn Iterator<Item = Result<Picture>>>,
}

impl Video {
    /// Opens a folder of PNG and JPEG files, taken in natural order (`2.png` before `10.png`), or a video file.
    /// `frames_per_s` goes before what the file says; a folder says nothing.
    pub fn open(path: &Path, frames_per_s: Option<f64>) -> Result<Self> {
        if path.is_dir() {
            let mut images = deepsft_formats::pictures_in(path, "folder of frames")?;
            // By what is shown of the names: one that is not UTF-8 does not change the order of the others.
            images.sort_by(|a, b| alphanumeric_sort::compare_str(a.to_string_lossy(), b.to_string_lossy()));
            return Ok(Self {
                frames_per_s: frames_per_s.unwrap_or(TYPICAL_RATE),
                count: Some(images.len() as u64),
                frames: Box::new(until_error(pictures(images))),
            });
        }
        let video = path.to_path_buf();
        let stream = open_stream(path)?;
        Ok(Self {
            frames_per_s: frames_per_s.unwrap_or(stream.frames_per_s()),
            count: None,
            frames: Box::new(until_error(stream.map(move |frame| frame.blame("video", &video)))),
        })
    }
}

/// The frames until the first error, which is the last of them.
fn until_error(frames: impl Iterator<Item = Result<Picture>>) -> impl Iterator<Item = Result<Picture>> {
    let mut frames = Some(frames);
    std::iter::from_fn(move || {
        let frame = frames.as_mut()?.next()?;
        if frame.is_err() {
            frames = None;
        }
        Some(frame)
    })
}

/// The pictures of files; all must have the size of the first.
fn pictures(paths: Vec<PathBuf>) -> impl Iterator<Item = Result<Picture>> {
    let mut size = None;
    paths.into_iter().map(move |path| {
        let picture = input::picture(&path)?;
        let actual = picture.size();
        let expected = *size.get_or_insert(actual);
        if actual != expected {
            let different = anyhow::anyhow!("it has {actual} pixels, the frames before it {expected}");
            return Err(different).blame("image", &path);
        }
        Ok(picture)
    })
}

fn open_stream(path: &Path) -> Result<Yuv4Mpeg<Box<dyn Read>>> {
    let y4m = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("y4m"));
    let open = || -> Result<fs::File> {
        let file = fs::File::open(path)?;
        if file.metadata()?.len() == 0 {
            bail!("it is empty (0 bytes)");
        }
        Ok(file)
    };
    let file = open().blame("video", path)?;
    let source: Box<dyn Read> = if y4m {
        Box::new(file)
    } else {
        Box::new(Ffmpeg::start(path)?)
    };
    Yuv4Mpeg::new(source).blame("video", path)
}

/// The program ffmpeg decoding a video; reading gives the stream it writes. Where it ends with an error, so does the reading. Of a video
/// that was cut short it decodes what is there, complains, and ends as if all were well: a complaint is harmless where as many frames came as
/// the file announces, and an error elsewhere.
struct Ffmpeg {
    path: PathBuf,
    process: Child,
    output: BufReader<std::process::ChildStdout>,
    /// What it has to say, and how many frames it wrote. A thread reads it, or it would stop when nobody does.
    complaints: Option<JoinHandle<(String, u64)>>,
}

impl Ffmpeg {
    fn start(path: &Path) -> Result<Self> {
        let mut command = Command::new("ffmpeg");
        // Ctrl-C is for us: ffmpeg ends when nobody reads it any more.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let started = command
            .args(["-nostdin", "-v", "error", "-progress", "pipe:2", "-i"])
            .arg(address(path))
            .args(["-map", "0:v:0", "-vf", "scale=out_color_matrix=bt601:out_range=tv"])
            .args(["-pix_fmt", "yuv444p", "-f", "yuv4mpegpipe", "-"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let mut process = match started {
            Ok(process) => process,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => bail!(
                "{} is read by the program ffmpeg, which is not on the PATH: install it (on Debian and Ubuntu \
                 `apt install ffmpeg`, on macOS `brew install ffmpeg`, else from ffmpeg.org), or give a folder of \
                 PNG or JPEG frames or a .y4m file instead",
                path.display()
            ),
            Err(error) => return Err(error).context("the program ffmpeg could not be started"),
        };
        let (output, errors) = process
            .stdout
            .take()
            .zip(process.stderr.take())
            .context("the program ffmpeg has no output")?;
        let read = move || {
            let mut text = Vec::new();
            // What cannot be read is not reported.
            let _ = BufReader::new(errors).read_to_end(&mut text);
            let text = String::from_utf8_lossy(&text);
            let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
            let (progress, complaints): (Vec<&str>, Vec<&str>) = lines.partition(|line| is_progress(line));
            let frames = progress
                .iter()
                .rev()
                .find_map(|line| line.strip_prefix("frame=")?.trim().parse().ok());
            let shown = complaints[..complaints.len().min(MAX_COMPLAINTS)].join("; ");
            let shown = match complaints.len().saturating_sub(MAX_COMPLAINTS) {
                0 => shown,
                more => format!("{shown}; and {more} more"),
            };
            (shown, frames.unwrap_or(0))
        };
        Ok(Self {
            path: path.to_path_buf(),
            process,
            output: BufReader::new(output),
            complaints: Some(std::thread::spawn(read)),
        })
    }
}

impl Read for Ffmpeg {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.output.read(buffer)?;
        if count > 0 || buffer.is_empty() {
            return Ok(count);
        }
        let status = self.process.wait()?;
        let complaints = self.complaints.take().and_then(|thread| thread.join().ok());
        match complaints.filter(|(text, _)| !text.is_empty()) {
            Some((text, frames))
                if status.success() && announced_frames(&self.path).is_some_and(|all| frames >= all) =>
            {
                eprintln!(
                    "warning: {}: ffmpeg decoded all {frames} frames and says: {text}",
                    self.path.display()
                );
                Ok(0)
            }
            Some((text, _)) => Err(std::io::Error::other(format!("ffmpeg: {text}"))),
            None if status.success() => Ok(0),
            None => Err(std::io::Error::other(format!("ffmpeg ended with {status}"))),
        }
    }
}

/// A file's name as ffmpeg takes it: with the protocol before it, none is taken for an option or an address.
fn address(path: &Path) -> OsString {
    let mut address = OsString::from("file:");
    address.push(path);
    address
}

/// Whether a line is one of ffmpeg's report of its progress, as `frame=60`.
fn is_progress(line: &str) -> bool {
    let is_name = |name: &str| {
        !name.is_empty()
            && name
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
    };
    line.split_once('=').is_some_and(|(name, _)| is_name(name))
}

/// How many frames a video's file says that it has. `None` where ffprobe does not tell.
fn announced_frames(path: &Path) -> Option<u64> {
    let told = Command::new("ffprobe")
        .args([
            "-v",
            "quiet",
            "-select_streams",
            "v:0",
            "-show_entries",
            "stream=nb_frames",
        ])
        .args(["-of", "csv=p=0"])
        .arg(address(path))
        .output();
    String::from_utf8_lossy(&told.ok()?.stdout)
        .trim()
        .trim_end_matches(',')
        .parse()
        .ok()
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // A decoder whose output nobody wants any more; when it has ended by itself there is nothing to end.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::encode_png;

    #[test]
    fn the_images_of_a_folder_come_in_natural_order_and_other_files_do_not() {
        let folder = tempfile::tempdir().unwrap();
        for (name, shade) in [("f10.png", 10), ("f9.PNG", 9), ("f08.png", 8), ("f1.png", 1)] {
            let png = encode_png(&Picture::from_fn(6, 4, |_, _| [shade; 3])).unwrap();
            fs::write(folder.path().join(name), png).unwrap();
        }
        fs::write(folder.path().join("camera.json"), "{}").unwrap();
        let video = Video::open(folder.path(), None).unwrap();
        assert_eq!((video.count, video.frames_per_s), (Some(4), 30.0));
        let shades: Vec<u8> = video.frames.map(|frame| frame.unwrap().pixel(0, 0)[0]).collect();
        assert_eq!(shades, [1, 8, 9, 10]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_name_that_is_not_utf8_leaves_the_others_in_natural_order() {
        use std::os::unix::ffi::OsStrExt;
        let folder = tempfile::tempdir().unwrap();
        for (name, shade) in [
            (&b"f10.png"[..], 10),
            (b"f9.png", 9),
            (b"f09.png", 90),
            (b"g\xff.png", 99),
        ] {
            let png = encode_png(&Picture::from_fn(6, 4, |_, _| [shade; 3])).unwrap();
            fs::write(folder.path().join(std::ffi::OsStr::from_bytes(name)), png).unwrap();
        }
        let frames = Video::open(folder.path(), None).unwrap().frames;
        let shades: Vec<u8> = frames.map(|frame| frame.unwrap().pixel(0, 0)[0]).collect();
        assert_eq!(shades, [9, 90, 10, 99]);
    }

    #[test]
    fn the_frames_end_with_the_first_that_has_another_size() {
        let folder = tempfile::tempdir().unwrap();
        for (name, width) in [("f1.png", 6), ("f2.png", 7), ("f3.png", 6)] {
            let png = encode_png(&Picture::from_fn(width, 4, |_, _| [0; 3])).unwrap();
            fs::write(folder.path().join(name), png).unwrap();
        }
        let frames: Vec<_> = Video::open(folder.path(), None).unwrap().frames.collect();
        let [Ok(_), Err(error)] = frames.as_slice() else {
            panic!("{} frames", frames.len());
        };
        let message = format!("{error:#}");
        let parts = ["f2.png", "7 x 4 pixels, the frames before it 6 x 4"];
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}
