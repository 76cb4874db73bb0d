//! Parts of a data set, which jobs make side by side.

use crate::error::SynthError;
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// Part `number` of `of`, from 1.
///
/// ```
/// use deepsft_synth::DatasetPart;
/// let part: DatasetPart = "2/4".parse()?;
/// assert_eq!(part.indices(0, 100), 25..50);
/// assert_eq!(part.folder_name(), "part-2-of-4");
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetPart {
    number: u64,
    of: u64,
}

impl FromStr for DatasetPart {
    type Err = SynthError;

    fn from_str(text: &str) -> Result<Self, SynthError> {
        let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match numbers {
            Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err(SynthError::Refused(
                "expected I/N with I from 1 to N, like 2/8".to_owned(),
            )),
        }
    }
}

impl DatasetPart {
    /// All parts of a data set of `of`, in order.
    pub(super) fn all(of: u64) -> impl Iterator<Item = Self> {
        (1..=of).map(move |number| Self { number, of })
    }

    /// Which part, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// How many parts there are.
    pub fn of(self) -> u64 {
        self.of
    }

    /// The part's indices among `count` samples from `first` on; parts differ by one sample at most.
    pub fn indices(self, first: u64, count: u64) -> Range<u64> {
        let end = |number: u64| first + (u128::from(count) * u128::from(number) / u128::from(self.of)) as u64;
        end(self.number - 1)..end(self.number)
    }

    /// Name of the part's folder in the data set's.
    pub fn folder_name(self) -> String {
        format!("part-{}-of-{}", self.number, self.of)
    }
}

/// The number of parts of which there is any in `folder`; of several numbers the largest.
pub fn dataset_parts(folder: &Path) -> Option<u64> {
    let names = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let of = |name: String| -> Option<u64> { name.strip_prefix("part-")?.split_once("-of-")?.1.parse().ok() };
    names.filter_map(of).max()
}
