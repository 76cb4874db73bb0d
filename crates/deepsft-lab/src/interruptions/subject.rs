//! The commands that are interrupted, on so small an input that a run takes seconds.

use super::results::{self, Files};
use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;
use serde_json::Value;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Name of the folder that every command writes, and of a file of somebody in it.
const OUT: &str = "out";
const FOREIGN: &str = "notes.txt";

/// Bytes before the values of an .npy file with so short a header.
const NPY_HEADER: usize = 128;

/// A command that is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Subject {
    Synth,
    Train,
    Track,
    Clip,
    Reconstruct,
}

/// What is run: the program, and the folder with what the commands read.
pub struct Inputs {
    program: Vec<OsString>,
    folder: PathBuf,
}

impl Inputs {
    /// Makes those of `subjects` in `folder` for the template in `template`. The program is that at `program`, or what this
    /// program has of it.
    pub fn make(program: Option<&Path>, template: &Path, folder: PathBuf, subjects: &[Subject]) -> Result<Self> {
        let program = match program {
            Some(program) => vec![fs::canonicalize(program)?.into()],
            None => vec![env::current_exe()?.into(), "deepsft".into()],
        };
        results::copy(template, &folder.join("template"))?;
        let inputs = Self { program, folder };
        let clip = "clip --template template --frames 6 --seed 9000101 --out clip";
        let data = "synth --template template --count 20 --seed 8 --out data";
        for (line, users) in [
            (clip, &[Subject::Track, Subject::Reconstruct][..]),
            (data, &[Subject::Train]),
        ] {
            if users.iter().any(|user| subjects.contains(user)) {
                let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
                let run = inputs.run(&words, &inputs.folder)?;
                ensure!(run.succeeded, "{line}: {}", run.stderr);
            }
        }
        Ok(inputs)
    }

    fn path(&self, name: &str) -> OsString {
        self.folder.join(name).into()
    }

    /// The command for `arguments`, to run in `folder`.
    fn command(&self, arguments: &[OsString], folder: &Path) -> Command {
        let mut command = Command::new(&self.program[0]);
        command.args(&self.program[1..]).args(arguments).current_dir(folder);
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    /// Starts it.
    pub fn start(&self, arguments: &[OsString], folder: &Path) -> Result<Child> {
        Ok(self.command(arguments, folder).stderr(Stdio::null()).spawn()?)
    }

    /// Runs it to its end.
    pub fn run(&self, arguments: &[OsString], folder: &Path) -> Result<Ended> {
        let output = self.command(arguments, folder).stderr(Stdio::piped()).output()?;
        Ok(Ended {
            succeeded: output.status.success(),
            code: output.status.code(),
            stderr: String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        })
    }
}

/// A run that has ended by itself.
pub struct Ended {
    pub succeeded: bool,
    pub code: Option<i32>,
    pub stderr: String,
}

impl Subject {
    pub fn name(self) -> &'static str {
        match self {
            Self::Synth => "synth",
            Self::Train => "train",
            Self::Track => "track",
            Self::Clip => "clip",
            Self::Reconstruct => "reconstruct",
        }
    }

    /// The words of the command that writes the result; with another `seed` another one.
    pub fn arguments(self, inputs: &Inputs, seed: u64) -> Vec<OsString> {
        let template = inputs.path("template");
        let mut words: Vec<OsString> = vec![
            self.name().into(),
            "--template".into(),
            template,
            "--out".into(),
            OUT.into(),
        ];
        let mut add = |line: String| words.extend(line.split(' ').map(OsString::from));
        match self {
            Self::Synth => add(format!("--count 6 --shard-size 2 --seed {seed}")),
            Self::Clip => add(format!("--frames 6 --seed {seed}")),
            // Two batches of windows and one of whole frames, each followed by a measurement and a checkpoint.
            Self::Train => {
                add(format!(
                    "--samples 40 --evaluate-every 0.000001 --accuracy-frames 1 --seed {seed} --data"
                ));
                words.push(inputs.path("data"));
            }
            // It has no seed; the pace makes another result.
            Self::Track => {
                add(format!("--pictures --find-every {seed}"));
                words.push(inputs.path("clip"));
            }
            // It has no seed; another camera makes another result.
            Self::Reconstruct => {
                add(format!(
                    "--camera {}",
                    if seed == SEED { "realsense-d435" } else { "gopro-hero3" }
                ));
                words.push(inputs.path("clip/frame-00001.png"));
            }
        }
        words
    }

    /// The words of the command that goes on.
    pub fn again(self, inputs: &Inputs, seed: u64) -> Vec<OsString> {
        let mut words = self.arguments(inputs, seed);
        if self == Self::Train {
            words.push("--resume".into());
        }
        words
    }

    /// Where its result stands in the folder that it runs in.
    fn result(self) -> &'static str {
        match self {
            Self::Reconstruct => "out/frame-00001",
            _ => OUT,
        }
    }

    /// Names beside the result that a finished command leaves too.
    fn keeps(self) -> &'static [&'static str] {
        match self {
            Self::Train => &["out.checkpoint", "out.checkpoint.old"],
            _ => &[],
        }
    }

    /// Where the last file of the result is written before the folder comes to its place, and what is swapped before that.
    pub fn last_files(self) -> &'static [&'static str] {
        match self {
            Self::Synth => &["out.partial/dataset.json"],
            Self::Train => &["out.checkpoint.new/state.json", ".out.partial/weights.bpk"],
            Self::Track => &[".out.partial/track.json"],
            Self::Clip => &[".out.partial/clip.json"],
            Self::Reconstruct => &["out/.frame-00001.partial/sheet.png"],
        }
    }

    /// How far an interrupted run has come that goes on: samples that are made or trained on.
    pub fn progress(self, case: &Path) -> u64 {
        let read = |path: &str| -> Option<Value> { serde_json::from_slice(&fs::read(case.join(path)).ok()?).ok() };
        match self {
            Self::Synth => {
                let sum = |state: Value| {
                    state["shards"]
                        .as_array()?
                        .iter()
                        .map(|shard| shard["samples"].as_u64())
                        .sum()
                };
                read("out.partial/state.json").and_then(sum).unwrap_or(0)
            }
            Self::Train => {
                let samples = |place| read(place)?["samples"].as_u64();
                let places = ["out.checkpoint/state.json", "out.checkpoint.old/state.json"];
                places.into_iter().find_map(samples).unwrap_or(0)
            }
            _ => 0,
        }
    }
}

/// A result that must come out, and one that may be there before.
pub struct Expected {
    pub subject: Subject,
    /// An uninterrupted run's, without times.
    whole: Files,
    /// Of another seed, as it stands in its folder, times and somebody's file included.
    older: PathBuf,
    older_files: Files,
}

/// The seeds of the result and of the older one.
pub const SEED: u64 = 1;
const OLDER_SEED: u64 = 2;

impl Expected {
    /// Runs the command uninterruptedly, twice with one seed and once with another, below `folder`.
    pub fn make(subject: Subject, inputs: &Inputs, folder: &Path) -> Result<Self> {
        let run = |name: &str, seed: u64| -> Result<PathBuf> {
            let case = folder.join(name);
            fs::create_dir_all(&case)?;
            let ended = inputs.run(&subject.arguments(inputs, seed), &case)?;
            ensure!(ended.succeeded, "deepsft {}: {}", subject.name(), ended.stderr);
            Ok(case.join(subject.result()))
        };
        let results = |out: &Path| results::without_times(results::files(out)?.context("there is no result")?);
        let (one, two, older) = (run("whole", SEED)?, run("again", SEED)?, run("older", OLDER_SEED)?);
        let whole = results(&one)?;
        if let Some(difference) = results::difference(&results(&two)?, &whole) {
            bail!("two uninterrupted runs of {} differ: {difference}", subject.name());
        }
        fs::write(older.join(FOREIGN), "mine")?;
        let older_files = results::files(&older)?.context("there is no result")?;
        ensure!(
            results::difference(&results(&older)?, &whole).is_some(),
            "another seed gives the same result"
        );
        Ok(Self {
            subject,
            whole,
            older,
            older_files,
        })
    }

    /// Begins in `case`: nothing there, or an older result with somebody's file.
    pub fn begin(&self, case: &Path, with_older: bool) -> Result<()> {
        if case.exists() {
            fs::remove_dir_all(case)?;
        }
        fs::create_dir_all(case)?;
        if with_older {
            results::copy(&self.older, &case.join(self.subject.result()))?;
        }
        Ok(())
    }

    /// Whether the new result is in its place after an interruption. An error when what is there is neither the older result
    /// (or nothing, where there was none) nor the new one, whole. Of a video that could not be followed to its end, `track`
    /// keeps the frames until then: in its place if nothing else is there.
    pub fn check_interrupted(&self, case: &Path, with_older: bool) -> Result<bool> {
        if self.subject == Subject::Track
            && let Some(beginning) = results::files(&case.join("out.partial"))?
        {
            ensure!(with_older, "a partial track lies beside no whole one");
            self.check_beginning(beginning)?;
        }
        let Some(found) = results::files(&case.join(self.subject.result()))? else {
            ensure!(!with_older, "the older result is gone");
            return Ok(false);
        };
        if with_older && found == self.older_files {
            return Ok(false);
        }
        let report = found.get("track.json");
        if !with_older && report.is_some_and(|report| String::from_utf8_lossy(report).contains("ended_early")) {
            self.check_beginning(found)?;
            return Ok(false);
        }
        let mut found = results::without_times(found)?;
        // It goes last; a data set with it is whole.
        if self.subject == Subject::Synth {
            found.remove("state.json");
        }
        match results::difference(&found, &self.new_files(with_older)) {
            None => Ok(true),
            Some(difference) => bail!("the result in its place is neither the older one nor the new one: {difference}"),
        }
    }

    /// An error when `found` is not a track of the first frames, whole as far as it goes.
    fn check_beginning(&self, found: Files) -> Result<()> {
        let found = results::without_times(found)?;
        let frames = |files: &Files| -> Result<Vec<Value>> {
            let report = files.get("track.json").context("it has no report")?;
            let report: Value = serde_json::from_slice(report)?;
            Ok(report["per_frame"]
                .as_array()
                .context("its report has no frames")?
                .clone())
        };
        let (some, all) = (frames(&found)?, frames(&self.whole)?);
        ensure!(
            !some.is_empty() && all.starts_with(&some),
            "the frames of a partial track differ"
        );
        let pictures = found.keys().filter(|name| name.starts_with("pictures/")).count();
        let rows = found
            .get("track.csv")
            .context("it has no table")?
            .split(|&byte| byte == b'\n')
            .count();
        // The header, and nothing after the last line's end.
        ensure!(
            pictures == some.len() && rows == some.len() + 2,
            "{} frames, {pictures} pictures, {rows} lines in a partial track",
            some.len()
        );
        for (name, bytes) in &found {
            let whole = self
                .whole
                .get(name)
                .with_context(|| format!("{name} is no file of a track"))?;
            let begins_at = match name.as_str() {
                "track.json" => continue,
                // After the number of frames.
                "vertices.npy" => NPY_HEADER.min(bytes.len()),
                _ => 0,
            };
            ensure!(
                whole[begins_at..].starts_with(&bytes[begins_at..]),
                "{name} of a partial track differs"
            );
        }
        let a_frame = (self.whole["vertices.npy"].len() - NPY_HEADER) / all.len();
        ensure!(
            found["vertices.npy"].len() == NPY_HEADER + a_frame * some.len(),
            "vertices.npy of a partial track has no whole frames"
        );
        Ok(())
    }

    /// An error when a command that has ended well has not left the result of an uninterrupted one, and nothing else.
    pub fn check_finished(&self, case: &Path, with_older: bool) -> Result<()> {
        let found = results::files(&case.join(self.subject.result()))?.context("there is no result")?;
        if let Some(difference) = results::difference(&results::without_times(found)?, &self.new_files(with_older)) {
            bail!("the result is not that of an uninterrupted run: {difference}");
        }
        let place = case.join(self.subject.result());
        for entry in fs::read_dir(place.parent().context("it has a folder above it")?)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            ensure!(
                path == place || self.subject.keeps().contains(&name.as_ref()),
                "{name} is left beside the result"
            );
        }
        Ok(())
    }

    fn new_files(&self, with_older: bool) -> Files {
        let mut files = self.whole.clone();
        if with_older {
            files.insert(FOREIGN.to_owned(), b"mine".to_vec());
        }
        files
    }
}
