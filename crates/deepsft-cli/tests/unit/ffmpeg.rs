//! What ffmpeg makes of videos as people have them: each is made here.

use crate::video::{Video, VideoFrame};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Frames of a video that a test makes.
const FRAMES: u8 = 12;

/// Runs ffmpeg in a folder. The tests need the program: what it makes of files is what they are about.
fn ffmpeg(folder: &Path, line: &str) {
    let made = Command::new("ffmpeg")
        .args(["-v", "error", "-y"])
        .args(line.split(' '))
        .current_dir(folder)
        .output();
    let made = made.expect("the tests need ffmpeg (Debian: apt-get install ffmpeg)");
    assert!(
        made.status.success(),
        "{line}: {}",
        String::from_utf8_lossy(&made.stderr)
    );
}

/// A folder with `gray.y4m`: frame `n` of 161 x 91 pixels is all of the level `40 + 10 n`, but for a darker column at its left.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut stream = b"YUV4MPEG2 W161 H91 F30:1 C444 XCOLORRANGE=FULL\n".to_vec();
    for level in (0..FRAMES).map(level) {
        stream.extend(b"FRAME\n");
        stream.extend((0..161 * 91).map(|pixel| if pixel % 161 < 16 { level / 2 } else { level }));
        stream.extend([128; 2 * 161 * 91]);
    }
    fs::write(folder.path().join("gray.y4m"), stream).unwrap();
    folder
}

fn level(frame: u8) -> u8 {
    40 + 10 * frame
}

fn frames(folder: &Path, name: &str) -> Vec<VideoFrame> {
    let video = Video::open(&folder.join(name), None, true).unwrap();
    video.frames.map(Result::unwrap).collect()
}

/// Checks that a video shows each frame of `gray.y4m` once.
fn assert_each_once(frames: &[VideoFrame], tolerance: u8) {
    assert_eq!(frames.len(), usize::from(FRAMES));
    for (number, frame) in frames.iter().enumerate() {
        let shown = frame
            .picture
            .pixel(frame.picture.width() - 5, frame.picture.height() - 3);
        let level = level(number as u8);
        assert!(
            shown.iter().all(|shown| shown.abs_diff(level) <= tolerance),
            "frame {number}: {shown:?}, not {level}"
        );
    }
}

fn times(frames: &[VideoFrame]) -> Vec<f64> {
    frames.iter().map(|frame| (1000.0 * frame.time_s).round()).collect()
}

#[test]
fn frames_of_a_variable_rate_keep_their_times_and_come_once() {
    let folder = folder();
    let folder = folder.path();
    // Four frames in 0.1 s, then 1 s without, then two that are as near as the container tells them apart, the rest at 10 a second.
    let at = "if(lt(N,4),N/40,if(lt(N,6),1.1+(N-4)/1000,1.2+(N-6)/10))";
    for (name, codec) in [
        ("rate.mkv", "ffv1"),
        ("rate.mp4", "mpeg4 -q:v 1 -video_track_timescale 1000 -bf 2"),
    ] {
        let at = at.replace(',', "\\,");
        ffmpeg(
            folder,
            &format!(
                "-i gray.y4m -vf settb=1/1000,setpts=({at})/TB -vsync passthrough -enc_time_base 1/1000 -c:v {codec} {name}"
            ),
        );
        let frames = frames(folder, name);
        assert_each_once(&frames, 3);
        let expected = [
            0.0, 25.0, 50.0, 75.0, 1100.0, 1101.0, 1200.0, 1300.0, 1400.0, 1500.0, 1600.0, 1700.0,
        ];
        let apart = times(&frames)
            .iter()
            .zip(expected)
            .map(|(a, b): (&f64, f64)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(
            apart <= 1.0 && frames.windows(2).all(|two| two[0].time_s < two[1].time_s),
            "{name}: {:?}",
            times(&frames)
        );
    }
    let constant = Video::open(&folder.join("rate.mkv"), Some(10.0), true).unwrap();
    let frames: Vec<_> = constant.frames.map(Result::unwrap).collect();
    assert_eq!(times(&frames)[..3], [0.0, 100.0, 200.0]);
}

/// The samples of white paper at `cd_m2` (ITU-R BT.2100, 10 bits of a narrow range).
fn sample(transfer: &str, cd_m2: f64) -> u16 {
    let signal = match transfer {
        "smpte2084" => {
            let y = (cd_m2 / 10_000.0).powf(0.159_301_757_812_5);
            ((0.835_937_5 + 18.851_562_5 * y) / (1.0 + 18.687_5 * y)).powf(78.843_75)
        }
        _ => {
            let scene: f64 = (cd_m2 / 1000.0).powf(1.0 / 1.2);
            match scene <= 1.0 / 12.0 {
                true => (3.0 * scene).sqrt(),
                false => 0.178_832_77 * (12.0 * scene - 0.284_668_92).ln() + 0.559_910_73,
            }
        }
    };
    (64.0 + 876.0 * signal).round() as u16
}

#[test]
fn a_high_dynamic_range_is_reduced_to_the_ordinary_one() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Levels of an ordinary screen (BT.1886) whose white is paper's; the last is three times as bright.
    let levels = [
        32.0,
        64.0,
        96.0,
        128.0,
        160.0,
        192.0,
        255.0,
        255.0 * 3_f64.powf(1.0 / 2.4),
    ];
    for transfer in ["arib-std-b67", "smpte2084"] {
        let samples = levels.map(|level: f64| sample(transfer, 203.0 * (level / 255.0).powf(2.4)));
        let mut stream = b"YUV4MPEG2 W161 H91 F30:1 C420p10 XYSCSS=420P10\nFRAME\n".to_vec();
        stream.extend((0..161 * 91).flat_map(|pixel| samples[pixel % 161 / 21].to_le_bytes()));
        stream.extend((0..2 * 81 * 46).flat_map(|_| 512_u16.to_le_bytes()));
        fs::write(folder.join("bright.y4m"), stream).unwrap();
        let tags = format!("-color_primaries bt2020 -color_trc {transfer} -colorspace bt2020nc -color_range tv");
        ffmpeg(folder, &format!("{tags} -i bright.y4m {tags} -c:v ffv1 bright.mkv"));
        let frame = frames(folder, "bright.mkv").swap_remove(0);
        let shown: Vec<u8> = (0..8).map(|k| frame.picture.pixel(21 * k + 10, 45)[1]).collect();
        for (shown, level) in shown.iter().zip(&levels[..6]) {
            assert!(
                (f64::from(*shown) - level).abs() <= 4.0,
                "{transfer}: {shown:?} for {levels:?}"
            );
        }
        assert!(
            (236..=252).contains(&shown[6]) && shown[7] > shown[6],
            "{transfer}: {shown:?}"
        );
    }
}

#[test]
fn the_video_of_a_file_is_taken_as_it_is_shown() {
    let folder = folder();
    let folder = folder.path();
    // Sound first, a picture of the cover, a track of data (the time code), odd sides.
    let sound = "-f lavfi -t 0.4 -i anullsrc -i gray.y4m";
    ffmpeg(folder, "-i gray.y4m -frames:v 1 -vf negate cover.png");
    ffmpeg(
        folder,
        &format!(
            "{sound} -i cover.png -map 0 -map 2 -map 1 -c:a aac -c:v:0 png -c:v:1 mpeg4 -q:v 1 -pix_fmt:v:1 yuv420p -disposition:v:0 \
                  attached_pic -timecode 00:00:00:00 phone.mov"
        ),
    );
    let shown = frames(folder, "phone.mov");
    assert_each_once(&shown, 3);
    assert_eq!(shown[0].picture.size(), (161, 91).into());
    // A webcam's: full range.
    ffmpeg(folder, "-i gray.y4m -c:v mjpeg -q:v 1 -pix_fmt yuvj422p webcam.avi");
    assert_each_once(&frames(folder, "webcam.avi"), 3);
    // Turned when it is shown, by the matrix of the track's header: by a quarter clockwise, and upside down.
    let movie = fs::read(folder.join("phone.mov")).unwrap();
    let header = |n: usize| {
        movie
            .windows(4)
            .enumerate()
            .filter(|(_, name)| *name == b"tkhd")
            .map(|(at, _)| at)
            .nth(n)
            .unwrap()
    };
    let straight: Vec<u8> = [1_i32 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30]
        .iter()
        .flat_map(|v| v.to_be_bytes())
        .collect();
    for (turn, quarters, size) in [
        ([0, 1, -1, 0], 1, (91, 161)),
        ([-1, 0, 0, -1], 2, (161, 91)),
        ([0, -1, 1, 0], 3, (91, 161)),
    ] {
        let mut turned = movie.clone();
        for number in 0.. {
            let at = header(number);
            let matrix = at + 4 + 40..at + 4 + 40 + 36;
            // That of the video has a width.
            if turned[matrix.end..matrix.end + 4] == [0; 4] {
                continue;
            }
            assert_eq!(turned[matrix.clone()], straight);
            let [a, b, c, d] = turn.map(|v: i32| v << 16);
            let matrix_values = [a, b, 0, c, d, 0, 0, 0, 1 << 30];
            turned[matrix].copy_from_slice(&matrix_values.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<_>>());
            break;
        }
        fs::write(folder.join("turned.mov"), turned).unwrap();
        let mut video = Video::open(&folder.join("turned.mov"), None, true).unwrap();
        assert_eq!(video.quarters, quarters);
        let picture = video.frames.next().unwrap().unwrap().picture;
        assert_eq!(picture.size(), size.into());
        // The darker column is now above, at the right or below.
        let (width, height) = (picture.width(), picture.height());
        let dark = [(width / 2, 4), (width - 5, height / 2), (width / 2, height - 5)][quarters - 1];
        let bright = [(width / 2, height - 5), (4, height / 2), (width / 2, 4)][quarters - 1];
        assert!(
            picture.pixel(dark.0, dark.1)[0] < 25 && picture.pixel(bright.0, bright.1)[0] > 35,
            "{quarters}"
        );
        let mut stored = Video::open(&folder.join("turned.mov"), None, false).unwrap();
        assert_eq!(stored.frames.next().unwrap().unwrap().picture.size(), (161, 91).into());
    }
}

#[test]
fn what_is_damaged_is_a_warning_and_what_was_cut_an_error() {
    let folder = folder();
    let folder = folder.path();
    let count = |name: &str| -> (usize, Option<String>) {
        let mut count = 0;
        for frame in Video::open(&folder.join(name), None, true).unwrap().frames {
            match frame {
                Ok(_) => count += 1,
                Err(error) => return (count, Some(format!("{error:#}"))),
            }
        }
        (count, None)
    };
    let noise = "-f lavfi -i testsrc2=size=160x90:rate=30:duration=2";
    for (kind, codec) in [
        ("avi", "mjpeg -q:v 3"),
        ("mkv", "mjpeg -q:v 3"),
        ("mp4", "mpeg4 -movflags +faststart"),
        ("webm", "vp8"),
    ] {
        let name = format!("whole.{kind}");
        ffmpeg(folder, &format!("{noise} -c:v {codec} {name}"));
        let whole = fs::read(folder.join(&name)).unwrap();
        assert_eq!(count(&name), (60, None));
        for part in [2, 30] {
            let cut = format!("cut.{kind}");
            fs::write(folder.join(&cut), &whole[..whole.len() - whole.len() / part]).unwrap();
            let (frames, error) = count(&cut);
            assert!(
                (20..60).contains(&frames) && error.is_some_and(|error| error.contains("ffmpeg: ")),
                "{cut}: {frames}"
            );
        }
        if !codec.starts_with("mjpeg") {
            continue;
        }
        // The end of the first frame is not there, then nothing of it.
        let begin = whole.windows(2).position(|marker| marker == [0xff, 0xd8]).unwrap();
        let end = begin
            + whole[begin..]
                .windows(2)
                .position(|marker| marker == [0xff, 0xd9])
                .unwrap()
            + 2;
        for (from, frames) in [(end - 200, 60), (begin, 59)] {
            let mut damaged = whole.clone();
            damaged[from..end].fill(0);
            fs::write(folder.join(&name), damaged).unwrap();
            assert_eq!(count(&name), (frames, None), "{name}");
        }
    }
}
