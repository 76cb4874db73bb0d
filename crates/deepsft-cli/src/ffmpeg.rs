//! The program ffmpeg decoding a video, and what ffprobe tells of one.

use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Complaints of ffmpeg that an error quotes.
const MAX_COMPLAINTS: usize = 3;

/// Levels of what ffmpeg says from which on it is a complaint, and those below.
const COMPLAINTS: [&str; 3] = ["[error] ", "[fatal] ", "[panic] "];
const REMARKS: [&str; 2] = ["[info] ", "[warning] "];

/// How long a frame's time may come after the frame.
const PATIENCE: Duration = Duration::from_secs(5);

/// From brightness as screens of a high dynamic range show it to the range of an ordinary video: paper white (203 cd/m², ITU-R BT.2408) is its
/// white, and what is brighter is gathered in its upper fifth.
const TO_ORDINARY_RANGE: &str = "format=yuv444p10le,zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=bt709,\
                                 tonemap=mobius:param=0.8:desat=0,zscale=t=bt709:m=170m:r=tv,format=yuv444p";
/// Of any other video.
const AS_IT_IS: &str = "scale=out_color_matrix=bt601:out_range=tv";

/// Says of each frame when it is shown, then gives it a number for its time: none is repeated or dropped for the sake of a constant rate.
const TOLD_AND_COUNTED: &str = "showinfo=checksum=0,settb=1/25,setpts=N";

/// The program ffmpeg decoding a video; reading gives the stream it writes. Where it ends with an error, so does the reading. Of a video
/// that was cut short it decodes what is there, complains, and ends as if all were well: a complaint is harmless where the frames reach the end
/// that the file announces, and an error elsewhere.
pub struct Ffmpeg {
    path: PathBuf,
    contents: Contents,
    process: Child,
    output: BufReader<ChildStdout>,
    /// A thread reads what it has to say, or it would stop when nobody does.
    said: Option<JoinHandle<Said>>,
}

/// What ffmpeg has said.
#[derive(Default)]
struct Said {
    complaints: Vec<String>,
    /// Lines of no level: of what started it.
    others: Vec<String>,
    frames: u64,
    last_s: f64,
}

impl Ffmpeg {
    /// Starts decoding; the frames are upright, or else as the camera's sensor has them. What is returned with it gives the time of each
    /// frame as the container has it, seconds, in the frames' order.
    pub fn start(
        path: &Path,
        contents: Contents,
        upright: bool,
    ) -> Result<(Self, impl FnMut() -> Option<f64> + use<>)> {
        let colors = match contents.high_range() {
            None => AS_IT_IS,
            Some(_) if has_filters(&["zscale", "tonemap"]) => TO_ORDINARY_RANGE,
            Some(name) => {
                eprintln!(
                    "warning: {}: it has a high dynamic range ({name}), and this ffmpeg has no filter zscale to reduce it: the print is \
                     looked for in colours that are paler than its own; install an ffmpeg with zimg, or record without HDR",
                    path.display()
                );
                AS_IT_IS
            }
        };
        let mut command = decoding(path, upright, "level+info");
        // Ctrl-C is for us: ffmpeg ends when nobody reads it any more.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let started = command
            // A picture of the cover is no video; nor are tracks of sound and data.
            .args(["-map", "0:V:0", "-vf", &format!("{colors},{TOLD_AND_COUNTED}")])
            .args(["-r", "25", "-pix_fmt", "yuv444p", "-f", "yuv4mpegpipe", "-"])
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
        let (told, times) = channel();
        let decoder = Self {
            path: path.to_path_buf(),
            contents,
            process,
            output: BufReader::new(output),
            said: Some(std::thread::spawn(move || Said::read(BufReader::new(errors), &told))),
        };
        let mut times = Some(times);
        let next_time = move || {
            let time = times.as_ref()?.recv_timeout(PATIENCE);
            if time.is_err() {
                times = None;
            }
            time.ok()?
        };
        Ok((decoder, next_time))
    }
}

impl Said {
    /// Reads all that ffmpeg says; the times of frames are passed on as they come.
    fn read(errors: impl BufRead, times: &Sender<Option<f64>>) -> Self {
        let mut said = Self::default();
        let mut tick_s = None;
        // What cannot be read is not reported.
        for line in errors.split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line);
            let line = line.trim_end();
            if let Some((source, text)) = COMPLAINTS.iter().find_map(|level| line.split_once(level)) {
                said.complaints.push(format!("{source}{text}"));
            } else if REMARKS.iter().any(|level| line.contains(level)) {
                if let Some((_, base)) = line.split_once("config in time_base: ") {
                    tick_s = base.split_once(',').and_then(|(base, _)| fraction(base));
                } else if let Some((_, frame)) = line.split_once("] n:")
                    && let Some((_, ticks)) = frame.split_once(" pts:")
                {
                    let ticks: Option<f64> = ticks.split_whitespace().next().and_then(|ticks| ticks.parse().ok());
                    let time = ticks.zip(tick_s).map(|(ticks, tick_s)| ticks * tick_s);
                    said.frames += 1;
                    said.last_s = time.unwrap_or(said.last_s);
                    // Nobody may want them any more.
                    let _ = times.send(time);
                }
            } else if !line.is_empty() {
                said.others.push(line.to_owned());
            }
        }
        said
    }

    /// The first complaints, on one line.
    fn summary(&self) -> String {
        let lines = if self.complaints.is_empty() {
            &self.others
        } else {
            &self.complaints
        };
        let shown = lines[..lines.len().min(MAX_COMPLAINTS)].join("; ");
        match lines.len().saturating_sub(MAX_COMPLAINTS) {
            0 => shown,
            more => format!("{shown}; and {more} more"),
        }
    }
}

impl Read for Ffmpeg {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.output.read(buffer)?;
        if count > 0 || buffer.is_empty() {
            return Ok(count);
        }
        let status = self.process.wait()?;
        let said = self
            .said
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default();
        if status.success() && said.complaints.is_empty() {
            return Ok(0);
        }
        let summary = said.summary();
        if status.success() && self.contents.are_all(&said) {
            let all = self.contents.frames().map_or(String::new(), |all| format!(" of {all}"));
            eprintln!(
                "warning: {}: ffmpeg decoded {}{all} frames to the end of the video and says: {summary}",
                self.path.display(),
                said.frames
            );
            return Ok(0);
        }
        Err(std::io::Error::other(match summary.is_empty() {
            true => format!("ffmpeg ended with {status}"),
            false => format!("ffmpeg: {summary} (copy the file again, or export it as MP4)"),
        }))
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        // A decoder whose output nobody wants any more; when it has ended by itself there is nothing to end.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// What ffprobe tells of a video's file; nothing where it does not.
pub struct Contents(Value);

impl Contents {
    /// Asks ffprobe.
    pub fn of(path: &Path) -> Self {
        let entries = "stream=nb_frames,duration,avg_frame_rate,color_transfer:stream_side_data=rotation:format=format_name,duration";
        let told = Command::new("ffprobe")
            .args(["-v", "quiet", "-select_streams", "V:0"])
            .args(["-of", "json", "-show_entries", entries])
            .arg(address(path))
            .output();
        let told = told.ok().and_then(|told| serde_json::from_slice(&told.stdout).ok());
        Self(told.unwrap_or_default())
    }

    /// What it says of the video; nothing is empty.
    fn stream(&self, field: &str) -> &str {
        self.0["streams"][0][field].as_str().unwrap_or_default()
    }

    /// As [`Contents::stream`], of the file.
    fn container(&self, field: &str) -> &str {
        self.0["format"][field].as_str().unwrap_or_default()
    }

    /// Whether it is known to have no video, as a recording of sound.
    pub fn lack_a_video(&self) -> bool {
        self.0["streams"][0].is_null() && !self.container("format_name").is_empty()
    }

    /// Frames per second, on average.
    pub fn frames_per_s(&self) -> Option<f64> {
        fraction(self.stream("avg_frame_rate")).filter(|rate| *rate > 0.0)
    }

    /// By how many quarters clockwise its frames are turned to be upright.
    pub fn quarters(&self) -> usize {
        let turns = self.0["streams"][0]["side_data_list"].as_array().into_iter().flatten();
        // Anticlockwise.
        let degrees = turns.filter_map(|turn| turn["rotation"].as_f64()).next().unwrap_or(0.0);
        (-degrees / 90.0).round().rem_euclid(4.0) as usize
    }

    /// The name of its high dynamic range, if it has one.
    fn high_range(&self) -> Option<&'static str> {
        match self.stream("color_transfer") {
            "arib-std-b67" => Some("HLG"),
            "smpte2084" => Some("PQ"),
            _ => None,
        }
    }

    fn frames(&self) -> Option<u64> {
        self.stream("nb_frames").parse().ok()
    }

    /// Whether what ffmpeg decoded is all of it: as many frames as the file announces, or frames up to its end. Of a file that announces neither
    /// its reader would have complained.
    fn are_all(&self, said: &Said) -> bool {
        if self.frames().is_some_and(|all| said.frames >= all) {
            return true;
        }
        let reader = format!("[{} @", self.container("format_name"));
        let durations = [self.stream("duration"), self.container("duration")];
        let told_s: Option<f64> = durations.into_iter().find_map(|seconds| seconds.parse().ok());
        // Of some files that were cut the duration is that of what is left, and only the number of frames is the old one.
        let rates = self.frames().zip(self.frames_per_s());
        let counted_s = rates.map(|(all, rate)| all as f64 / rate);
        let duration_s = told_s.into_iter().chain(counted_s).fold(0.0, f64::max);
        // The last frame is shown for about as long as others.
        let end_s = said.last_s + 1.5 * duration_s / said.frames.max(1) as f64;
        said.frames > 0 && end_s >= duration_s && !said.complaints.iter().any(|line| line.starts_with(&reader))
    }
}

/// Whether ffmpeg has all these filters.
fn has_filters(names: &[&str]) -> bool {
    let told = Command::new("ffmpeg").args(["-v", "quiet", "-filters"]).output();
    let told = told.map(|told| String::from_utf8_lossy(&told.stdout).into_owned());
    told.is_ok_and(|told| {
        names
            .iter()
            .all(|name| told.split_whitespace().any(|word| word == *name))
    })
}

/// The program ffmpeg as it decodes a file, upright or not, and says what has this `level`; what becomes of the frames is still to be said.
pub fn decoding(path: &Path, upright: bool, level: &str) -> Command {
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-nostats", "-v", level]);
    command.args((!upright).then_some("-noautorotate"));
    command.arg("-i").arg(address(path));
    command
}

/// A file's name as ffmpeg takes it: with the protocol before it, none is taken for an option or an address.
fn address(path: &Path) -> OsString {
    let mut address = OsString::from("file:");
    address.push(path);
    address
}

/// The value of a fraction of whole numbers, as `30000/1001`.
fn fraction(text: &str) -> Option<f64> {
    let (above, below) = text.trim().split_once('/')?;
    let (above, below): (f64, f64) = (above.parse().ok()?, below.parse().ok()?);
    (below > 0.0).then(|| above / below)
}
