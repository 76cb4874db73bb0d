//! Videos: a folder of images, a `.y4m` file, or anything that the program ffmpeg reads.

mod yuv4mpeg;

use crate::failure::BlameInput;
use crate::ffmpeg::{Contents, Ffmpeg};
use crate::input;
use anyhow::{Result, anyhow};
use deepsft_geometry::Picture;
use std::fs;
use std::path::{Path, PathBuf};

pub use yuv4mpeg::Yuv4Mpeg;

/// Frames per second where nobody tells.
const TYPICAL_RATE: f64 = 30.0;

/// A video that is read frame by frame.
pub struct Video {
    /// Frames per second, on average.
    pub frames_per_s: f64,
    /// Number of frames, where it is known beforehand.
    pub count: Option<u64>,
    /// By how many quarters clockwise its frames were turned since they were taken.
    pub quarters: usize,
    /// The frames in order; they end with the first error.
    pub frames: Box<dyn Iterator<Item = Result<VideoFrame>>>,
}

/// A frame of a video.
#[derive(Clone, Debug, PartialEq)]
pub struct VideoFrame {
    /// What it shows.
    pub picture: Picture,
    /// When it is shown, seconds, ascending: as the video's file says, where it has times of frames.
    pub time_s: f64,
}

impl Video {
    /// Opens a folder of PNG and JPEG files, taken in natural order (`2.png` before `10.png`), or a video file, whose frames are turned
    /// upright, or else are as the camera's sensor has them. `frames_per_s` goes before what the file says; a folder says nothing.
    pub fn open(path: &Path, frames_per_s: Option<f64>, upright: bool) -> Result<Self> {
        if path.is_dir() {
            let mut images = deepsft_formats::pictures_in(path, "folder of frames")?;
            // By what is shown of the names: one that is not UTF-8 does not change the order of the others.
            images.sort_by(|a, b| alphanumeric_sort::compare_str(a.to_string_lossy(), b.to_string_lossy()));
            let count = Some(images.len() as u64);
            let rate = frames_per_s.unwrap_or(TYPICAL_RATE);
            return Ok(Self::new(rate, count, pictures(images), || None));
        }
        let file = fs::File::open(path).blame("video", path)?;
        let refused = |reason: &'static str| Err(anyhow!(reason)).blame("video", path);
        if file.metadata().blame("video", path)?.len() == 0 {
            return refused("it is empty (0 bytes): copy it again from where it came");
        }
        let blamed = path.to_path_buf();
        let blame = move |frame: Result<Picture>| frame.blame("video", &blamed);
        if path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("y4m"))
        {
            let stream = Yuv4Mpeg::new(file).blame("video", path)?;
            let rate = frames_per_s.unwrap_or(stream.frames_per_s());
            return Ok(Self::new(rate, None, stream.map(blame), || None));
        }
        let contents = Contents::of(path);
        if contents.lack_a_video() {
            return refused("there is no video in it, only sound or data: choose another file");
        }
        let rate = frames_per_s.or(contents.frames_per_s()).unwrap_or(TYPICAL_RATE);
        let quarters = if upright { contents.quarters() } else { 0 };
        let (ffmpeg, mut times) = Ffmpeg::start(path, contents, upright)?;
        let stream = Yuv4Mpeg::new(ffmpeg).blame("video", path)?;
        let time = move || times().filter(|_| frames_per_s.is_none());
        Ok(Self {
            quarters,
            ..Self::new(rate, None, stream.map(blame), time)
        })
    }

    /// A video of these `frames`, of which `time` tells when each is shown, if that is known.
    fn new(
        frames_per_s: f64,
        count: Option<u64>,
        frames: impl Iterator<Item = Result<Picture>> + 'static,
        mut time: impl FnMut() -> Option<f64> + 'static,
    ) -> Self {
        let (mut number, mut last_s) = (0.0, f64::NEG_INFINITY);
        let timed = frames.map(move |picture| {
            let picture = picture?;
            let expected_s = match number / frames_per_s {
                expected_s if expected_s > last_s => expected_s,
                _ => last_s + 1.0 / frames_per_s,
            };
            // Times that stand still or go back are none.
            let time_s = time().filter(|told_s| *told_s > last_s).unwrap_or(expected_s);
            (number, last_s) = (number + 1.0, time_s);
            Ok(VideoFrame { picture, time_s })
        });
        // The first error is the last of them.
        let mut failed = false;
        let until_error = timed.take_while(move |frame| !std::mem::replace(&mut failed, frame.is_err()));
        Self {
            frames_per_s,
            count,
            quarters: 0,
            frames: Box::new(until_error),
        }
    }
}

/// The pictures of files; all must have the size of the first.
fn pictures(paths: Vec<PathBuf>) -> impl Iterator<Item = Result<Picture>> {
    let mut size = None;
    paths.into_iter().map(move |path| {
        let picture = input::picture(&path)?;
        let actual = picture.size();
        let expected = *size.get_or_insert(actual);
        if actual != expected {
            let different =
                anyhow!("it has {actual} pixels, the frames before it {expected}: leave it out, or make it as large");
            return Err(different).blame("image", &path);
        }
        Ok(picture)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::encode_png;

    /// A folder of pictures by name, each of one shade and so many pixels wide.
    fn folder_of(pictures: &[(impl AsRef<Path>, u8, usize)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, shade, width) in pictures {
            let png = encode_png(&Picture::from_fn(*width, 4, |_, _| [*shade; 3])).unwrap();
            fs::write(folder.path().join(name), png).unwrap();
        }
        folder
    }

    fn shades(video: Video) -> Vec<u8> {
        let shades = video.frames.map(|frame| frame.unwrap().picture.pixel(0, 0)[0]);
        shades.collect()
    }

    #[test]
    fn the_images_of_a_folder_come_in_natural_order_and_other_files_do_not() {
        let folder = folder_of(&[
            ("f10.png", 10, 6),
            ("f9.PNG", 9, 6),
            ("f08.png", 8, 6),
            ("f1.png", 1, 6),
        ]);
        fs::write(folder.path().join("camera.json"), "{}").unwrap();
        let video = Video::open(folder.path(), None, true).unwrap();
        assert_eq!((video.count, video.frames_per_s), (Some(4), 30.0));
        assert_eq!(shades(video), [1, 8, 9, 10]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_name_that_is_not_utf8_leaves_the_others_in_natural_order() {
        use std::os::unix::ffi::OsStrExt;
        let names = [&b"f10.png"[..], b"f9.png", b"f09.png", b"g\xff.png"].map(std::ffi::OsStr::from_bytes);
        let shaded = [10, 9, 90, 99];
        let folder = folder_of(&std::array::from_fn::<_, 4, _>(|k| (names[k], shaded[k], 6)));
        let video = Video::open(folder.path(), None, true).unwrap();
        assert_eq!(shades(video), [9, 90, 10, 99]);
    }

    #[test]
    fn the_frames_end_with_the_first_that_has_another_size() {
        let folder = folder_of(&[("f1.png", 0, 6), ("f2.png", 0, 7), ("f3.png", 0, 6)]);
        let frames: Vec<_> = Video::open(folder.path(), None, true).unwrap().frames.collect();
        let [Ok(_), Err(error)] = frames.as_slice() else {
            panic!("{} frames", frames.len());
        };
        let message = format!("{error:#}");
        let parts = ["f2.png", "7 x 4 pixels, the frames before it 6 x 4"];
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}
