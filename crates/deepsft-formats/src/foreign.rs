//! The border to the decoders of others, which foreign bytes may bring to panic.

use std::io::{Error, Result};
use std::panic::{AssertUnwindSafe, catch_unwind};

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Runs a decoder and returns its panic as an error. The program's panic hook has run by then.
///
/// WebAssembly cannot unwind: a panic ends the module there. What is known to panic is refused before, as palettes of PNG files that end within a colour.
pub fn guarded<T>(decode: impl FnOnce() -> T) -> Result<T> {
    // What the decoder leaves half done is dropped with it.
    catch_unwind(AssertUnwindSafe(decode)).map_err(|payload| {
        let reason = (payload.downcast_ref::<String>().map(String::as_str))
            .or_else(|| payload.downcast_ref::<&str>().copied())
            .unwrap_or("unknown reason");
        Error::other(format!("its decoder failed ({reason})"))
    })
}

/// Refuses a PNG file whose palette ends within a colour, on which the crate `png` 0.18 panics.
pub(crate) fn check_png(bytes: &[u8]) -> Result<()> {
    let mut rest = bytes.strip_prefix(PNG_SIGNATURE).unwrap_or_default();
    // A chunk: length of the content, name, content, checksum.
    while let Some(([a, b, c, d, name @ ..], content)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        if name == b"PLTE" && !length.is_multiple_of(3) {
            let reason = format!("its palette has {length} bytes, expected three for each colour");
            return Err(Error::other(reason));
        }
        rest = content.get(length.saturating_add(4)..).unwrap_or_default();
    }
    Ok(())
}

/// Refuses a JPEG file that was cut within its pixels: the decoder of the crate `image` fills what is missing with grey. A whole image that
/// lacks its end marker alone, as of some web cameras, passes.
#[cfg(feature = "pictures")]
pub(crate) fn check_jpeg_end(bytes: &[u8]) -> Result<()> {
    use zune_jpeg::{JpegDecoder, zune_core::options::DecoderOptions};
    let [start, scan, end] = [0xd8, 0xda, 0xd9].map(|marker| [0xff, marker]);
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    if !bytes.starts_with(&start) || last(end) > last(scan) {
        return Ok(());
    }
    let options = DecoderOptions::new_fast().set_strict_mode(true);
    let decoded = JpegDecoder::new_with_options(std::io::Cursor::new(bytes), options).decode();
    decoded
        .map(drop)
        .map_err(|_| Error::other("it was cut short, its last rows are missing: copy it again from where it came"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_that_panics_is_an_error_with_its_words() {
        let nothing = Vec::<u8>::new();
        let beyond = guarded(|| *nothing.first().expect("a third byte"));
        assert_eq!(beyond.unwrap_err().to_string(), "its decoder failed (a third byte)");
        let of = |bytes: &[u8]| guarded(|| assert!(bytes.len() > 2, "{} bytes", bytes.len()));
        assert_eq!(of(&[1, 2]).unwrap_err().to_string(), "its decoder failed (2 bytes)");
        assert!(of(&[1, 2, 3]).is_ok());
    }
}
