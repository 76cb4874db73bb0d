//! Parts of a data set, which jobs make side by side.

use crate::error::FormatError;
use std::ops::Range;
use std::str::FromStr;

/// Part `number` of `of`, from 1.
///
/// ```
/// use deepsft_formats::DatasetPart;
/// let part: DatasetPart = "2/4".parse()?;
/// assert_eq!(part.indices(0, 100), 25..50);
/// assert_eq!(part.folder_name(), "part-2-of-4");
/// # Ok::<(), deepsft_formats::FormatError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetPart {
    number: u64,
    of: u64,
}

impl FromStr for DatasetPart {
    type Err = FormatError;

    /// Reads `I/N`.
    fn from_str(text: &str) -> Result<Self, FormatError> {
        let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match numbers {
            Some((Ok(number), Ok(of))) => Self::new(number, of),
            _ => Err(FormatError::DatasetPart),
        }
    }
}

impl DatasetPart {
    /// Part `number` of `of`, from 1.
    ///
    /// # Errors
    /// [`FormatError::DatasetPart`] when `number` is not between 1 and `of`.
    pub fn new(number: u64, of: u64) -> Result<Self, FormatError> {
        match (1..=of).contains(&number) {
            true => Ok(Self { number, of }),
            false => Err(FormatError::DatasetPart),
        }
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
