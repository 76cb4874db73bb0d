//! Parts of a data set, which jobs make side by side.

use std::ops::Range;
use std::str::FromStr;

/// Part `number` of `of`, from 1.
///
/// ```
/// use deepsft_formats::DatasetPart;
/// let part: DatasetPart = "2/4".parse()?;
/// assert_eq!(part.indices(0, 100), 25..50);
/// assert_eq!(part.folder_name(), "part-2-of-4");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetPart {
    /// Which part, from 1.
    pub number: u64,
    /// How many parts there are.
    pub of: u64,
}

impl FromStr for DatasetPart {
    type Err = String;

    /// Reads `I/N`.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match numbers {
            Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err("expected I/N with I from 1 to N, like 2/8".to_owned()),
        }
    }
}

impl DatasetPart {
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
