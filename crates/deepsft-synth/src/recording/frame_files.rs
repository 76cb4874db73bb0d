//! Which files of somebody else's recording belong to one frame.

use super::pairing::ASSOCIATIONS_FILE;
use crate::error::SynthError;
use deepsft_formats::{FormatError, read_error};
use std::collections::{HashMap, HashSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Largest difference between the times of a frame's files, s: that of the TUM benchmark's tools.
const MAX_DIFFERENCE_S: f64 = 0.02;

/// Times above this count in units smaller than seconds: it is the year 5138.
const MAX_SECONDS: f64 = 1e11;

/// How files are known to belong to one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FramePairing {
    /// The last number in their names, or in what `*` stands for, is the same.
    Number,
    /// They have the same place in their folders, sorted by name with numbers by value.
    Order,
    /// Their times are nearest to each other, and at most 20 ms apart.
    ///
    /// Times are those that a list beside the folder tells (`NAME.txt` or `associations.txt`, lines of `time path`), or the last number
    /// in the names. They count in seconds, or in milli-, micro- or nanoseconds since 1970.
    Time,
}

/// Files of one kind, one for each frame.
pub(super) struct FrameFiles<'a> {
    /// What an error calls one of them.
    pub(super) what: &'static str,
    /// Their folder; or the path of all of them, with `*` for what differs in the name.
    pub(super) place: &'a Path,
    /// Whether a file is of this kind, by its name.
    pub(super) is_one: fn(&Path) -> bool,
}

/// The files of all frames, in order, each of the kinds asked for.
#[derive(Debug)]
pub(super) struct MatchedFiles {
    pub(super) frames: Vec<Vec<PathBuf>>,
    /// Those without a partner.
    pub(super) left_out: Vec<PathBuf>,
}

/// What `decode` makes of a file, a `what`.
pub(super) fn read<T, E: Display>(
    what: &'static str,
    path: &Path,
    decode: impl FnOnce(&[u8]) -> Result<T, E>,
) -> Result<T, SynthError> {
    let bytes = fs::read(path).map_err(|error| FormatError::unusable(what, path, read_error(error)))?;
    decode(&bytes).map_err(|error| FormatError::unusable(what, path, error).into())
}

/// Matches files of several kinds.
///
/// # Errors
/// [`FormatError::Unusable`] for a folder that cannot be read or has none of them, for files that differ in number where their order counts,
/// for two with one number or time, and where none belong together.
pub(super) fn matched(kinds: &[FrameFiles<'_>], pairing: FramePairing) -> Result<MatchedFiles, SynthError> {
    let lists: Vec<_> = kinds.iter().map(|kind| kind.keyed(pairing)).collect::<Result<_, _>>()?;
    let (first, first_kind) = (&lists[0], &kinds[0]);
    let tolerance = match pairing {
        FramePairing::Number => 0.0,
        FramePairing::Time => MAX_DIFFERENCE_S,
        FramePairing::Order => {
            if let Some((list, kind)) = lists.iter().zip(kinds).find(|(list, _)| list.len() != first.len()) {
                let (own, expected) = (list.len(), first.len());
                return Err(kind.refused(format!(
                    "it has {own} of them, {} has {expected}",
                    first_kind.place.display()
                )));
            }
            0.0
        }
    };
    let nearest = |list: &[KeyedFile], key: f64| {
        let distance = |file: &KeyedFile| file.key.map_or(f64::INFINITY, |own| (own - key).abs());
        let nearest = list.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.filter(|file| distance(file) <= tolerance).cloned()
    };
    let frame = |file: &KeyedFile| {
        // Each is the other's nearest: nothing is taken twice.
        let is_mutual = |other: &KeyedFile| nearest(first, other.key?).filter(|back| back == file);
        let files = lists
            .iter()
            .map(|list| nearest(list, file.key?).filter(|other| is_mutual(other).is_some()));
        files.map(|file| Some(file?.path)).collect::<Option<Vec<PathBuf>>>()
    };
    let frames: Vec<_> = first.iter().filter_map(frame).collect();
    if frames.is_empty() {
        return Err(first_kind.refused("none of them has its partners: choose another way to pair them"));
    }
    let used: HashSet<&PathBuf> = frames.iter().flatten().collect();
    let paths = lists.into_iter().flatten().map(|file| file.path);
    let left_out = paths.filter(|path| !used.contains(path)).collect();
    Ok(MatchedFiles { frames, left_out })
}

/// A file and what tells its frame, if it tells that.
#[derive(Clone, PartialEq)]
struct KeyedFile {
    key: Option<f64>,
    path: PathBuf,
}

impl FrameFiles<'_> {
    fn refused(&self, reason: impl Display) -> SynthError {
        FormatError::unusable(self.what, self.place, reason).into()
    }

    fn keyed(&self, pairing: FramePairing) -> Result<Vec<KeyedFile>, SynthError> {
        let name = self.place.file_name().unwrap_or_default().to_string_lossy();
        let (folder, before, after) = match name.split_once('*') {
            Some((before, after)) => (self.place.parent().unwrap_or(Path::new("")), before, after),
            None => (self.place, "", ""),
        };
        let folder = Some(folder)
            .filter(|folder| *folder != Path::new(""))
            .unwrap_or(Path::new("."));
        let list = || -> io::Result<Vec<String>> {
            fs::read_dir(folder)?
                .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
                .collect()
        };
        let mut names = list().map_err(|error| self.refused(read_error(error)))?;
        let is_one = |name: &String| {
            let is_long = name.len() >= before.len() + after.len();
            is_long && name.starts_with(before) && name.ends_with(after) && (self.is_one)(Path::new(name))
        };
        names.retain(is_one);
        names.sort_by(|a, b| alphanumeric_sort::compare_str(a, b));
        let times = listed_times(folder).filter(|_| pairing == FramePairing::Time);
        let varying = |name: &String| match before.len() + after.len() {
            0 => Path::new(name)
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            _ => name[before.len()..name.len() - after.len()].to_owned(),
        };
        let key = |(place, name): (usize, &String)| match (pairing, &times) {
            (FramePairing::Order, _) => Some(place as f64),
            (FramePairing::Number, _) => last_number(&varying(name), false),
            (FramePairing::Time, Some(times)) => times.get(name).copied(),
            (FramePairing::Time, None) => last_number(&varying(name), true),
        };
        let keys: Vec<_> = names.iter().enumerate().map(key).collect();
        let path = |name| folder.join(name);
        let mut files: Vec<_> = (keys.into_iter().zip(names))
            .map(|(key, name)| KeyedFile { key, path: path(name) })
            .collect();
        files.sort_by(|a, b| a.key.unwrap_or(f64::MAX).total_cmp(&b.key.unwrap_or(f64::MAX)));
        let is_same = |pair: &&[KeyedFile]| pair[0].key.is_some() && pair[0].key == pair[1].key;
        match files.windows(2).find(is_same) {
            Some([a, b]) => {
                let (a, b) = (a.path.display(), b.path.display());
                Err(self.refused(format!(
                    "{a} and {b} have one number: pair them by another, or name one kind with *"
                )))
            }
            _ if files.is_empty() => Err(self.refused("there is none of them in it: check the path")),
            _ => Ok(files),
        }
    }
}

/// The times of the files in `folder` by their names, s, as a list beside it tells them.
fn listed_times(folder: &Path) -> Option<HashMap<String, f64>> {
    let lists = [folder.with_extension("txt"), folder.with_file_name(ASSOCIATIONS_FILE)];
    let text = lists.iter().find_map(|list| fs::read_to_string(list).ok())?;
    let lines = text.lines().filter(|line| !line.trim_start().starts_with('#'));
    let words = lines.map(|line| line.split_whitespace().collect::<Vec<_>>());
    let times: HashMap<_, _> = (words.flat_map(|words| {
        let pair = |pair: &[&str]| {
            let path = Path::new(pair[1]);
            let is_here = path.parent()?.file_name() == folder.file_name();
            let name = path.file_name().filter(|_| is_here)?;
            Some((name.to_string_lossy().into_owned(), seconds(pair[0].parse().ok()?)))
        };
        words.chunks_exact(2).filter_map(pair).collect::<Vec<_>>()
    }))
    .collect();
    (!times.is_empty()).then_some(times)
}

/// The last number in what differs in the names; a `decimal` one is a time in seconds.
fn last_number(varying: &str, decimal: bool) -> Option<f64> {
    let varying = varying.trim_end_matches(|c: char| !c.is_ascii_digit());
    let digits = varying
        .rsplit(|c: char| !(c.is_ascii_digit() || decimal && c == '.'))
        .next()?;
    let number = digits.trim_start_matches('.').parse().ok()?;
    Some(if decimal { seconds(number) } else { number })
}

fn seconds(mut time: f64) -> f64 {
    while time.is_finite() && time > MAX_SECONDS {
        time /= 1000.0;
    }
    time
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_numbers_and_times() {
        for (name, number, time) in [
            ("frame-000012.color", Some(12.0), Some(12.0)),
            ("1305031102.175304", Some(175_304.0), Some(1_305_031_102.175_304)),
            (
                "1403636579763555",
                Some(1_403_636_579_763_555.0),
                Some(1_403_636_579.763_555),
            ),
            ("a_Color_1541684221187.25", Some(25.0), Some(1_541_684_221.187_25)),
            ("7_mask", Some(7.0), Some(7.0)),
            ("picture", None, None),
            ("1.2.3", Some(3.0), None),
        ] {
            let told = [last_number(name, false), last_number(name, true)];
            assert_eq!(told, [number, time], "{name}");
        }
    }
}
