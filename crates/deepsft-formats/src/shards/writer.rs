//! Shards written sample by sample.

use super::{EncodedSample, PARTS, SampleRecord};
use crate::error::FormatError;
use std::io::Write;

/// Writes samples as a shard, numbered from 0 in their order; returns how many there were. Depth is rounded to 0.1 mm,
/// registration to 1 / 65535.
///
/// # Errors
/// [`FormatError::Io`] from `out`, [`FormatError::DepthRange`] for a depth above 6553.5 mm.
pub fn write_shard(out: impl Write, records: impl IntoIterator<Item = SampleRecord>) -> Result<u64, FormatError> {
    let mut shard = ShardWriter::new(out);
    for record in records {
        shard.append(&record.encode()?)?;
    }
    let (number, _) = shard.finish()?;
    Ok(number)
}

/// Writes a shard sample by sample. Coding takes long and writing does not: with [`SampleRecord::encode`] many threads
/// can feed one writer.
pub struct ShardWriter<W: Write> {
    archive: tar::Builder<W>,
    samples: u64,
}

impl<W: Write> std::fmt::Debug for ShardWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShardWriter")
            .field("samples", &self.samples)
            .finish_non_exhaustive()
    }
}

impl<W: Write> ShardWriter<W> {
    /// An empty shard.
    pub fn new(out: W) -> Self {
        Self {
            archive: tar::Builder::new(out),
            samples: 0,
        }
    }

    /// Adds the next sample.
    ///
    /// # Errors
    /// [`FormatError::Io`] from the output.
    pub fn append(&mut self, sample: &EncodedSample) -> Result<(), FormatError> {
        for (part, content) in PARTS.into_iter().zip(&sample.0) {
            // Nothing of the machine or the moment goes into the header: equal samples are equal bytes.
            let mut header = tar::Header::new_ustar();
            header.set_size(content.len() as u64);
            header.set_mode(0o644);
            let name = format!("{:06}.{part}", self.samples);
            self.archive.append_data(&mut header, name, content.as_slice())?;
        }
        self.samples += 1;
        Ok(())
    }

    /// Ends the shard; gives the number of its samples and the output.
    ///
    /// # Errors
    /// [`FormatError::Io`] from the output.
    pub fn finish(self) -> Result<(u64, W), FormatError> {
        let mut out = self.archive.into_inner()?;
        out.flush()?;
        Ok((self.samples, out))
    }
}
