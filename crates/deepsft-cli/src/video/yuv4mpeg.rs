//! Uncompressed video, YUV4MPEG2 (`.y4m`): 8 bits a sample, grey or with colours of any of its subsamplings.

use anyhow::{Result, bail};
use deepsft::MAX_PICTURE_SIDE_PX;
use deepsft_geometry::Picture;
use std::cell::Cell;
use std::fmt;
use std::io::{BufRead, BufReader, Chain, Cursor, Read};
use std::rc::Rc;
use y4m::{Colorspace, Decoder, Error, Frame, Limits};

/// Bytes of a header line that are read; the `y4m` crate takes 1024.
const LONGEST_HEADER: u64 = 4096;

/// Largest frame that is read, bytes: grey with the longest sides. Its picture takes three times as many at most.
const LARGEST_FRAME: usize = 256 << 20;

/// The frames of a stream. After an error there is no more to be had of it.
pub struct Yuv4Mpeg<R: Read> {
    decoder: Decoder<Counted<R>>,
    /// Pixels to a sample of colour, across and down; `None` of grey.
    chroma: Option<[usize; 2]>,
    /// Whether 0 is black and 255 white; else 16 and 235.
    full_range: bool,
    /// Bytes read since the last whole frame.
    since_frame: Rc<Cell<usize>>,
}

impl<R: Read> fmt::Debug for Yuv4Mpeg<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width, height) = (self.decoder.get_width(), self.decoder.get_height());
        write!(f, "Yuv4Mpeg({width} x {height})")
    }
}

impl<R: Read> Yuv4Mpeg<R> {
    /// Reads the header.
    pub fn new(source: R) -> Result<Self> {
        let mut source = BufReader::new(source);
        let mut header = Vec::new();
        source.by_ref().take(LONGEST_HEADER).read_until(b'\n', &mut header)?;
        check_size(&header)?;
        let since_frame = Rc::new(Cell::new(0));
        let counted = Counted {
            source: Cursor::new(header).chain(source),
            count: Rc::clone(&since_frame),
        };
        let decoder = match Decoder::new_with_limits(counted, Limits { bytes: LARGEST_FRAME }) {
            Ok(decoder) => decoder,
            Err(Error::EOF) => bail!("it ends before the first frame: copy it again from where it came"),
            Err(Error::IoError(error)) => return Err(error.into()),
            Err(Error::OutOfMemory) => bail!(
                "its frames take more than {} MiB: make them smaller",
                LARGEST_FRAME >> 20
            ),
            Err(error) => bail!("its header is not one of YUV4MPEG2 ({error}): copy it again, or export it as MP4"),
        };
        let chroma = match decoder.get_colorspace() {
            Colorspace::Cmono => None,
            Colorspace::C420 | Colorspace::C420jpeg | Colorspace::C420mpeg2 | Colorspace::C420paldv => Some([2, 2]),
            Colorspace::C422 => Some([2, 1]),
            Colorspace::C444 => Some([1, 1]),
            other => bail!(
                "its colour space is {other:?}, and 8 bits a sample are read: convert it (ffmpeg -pix_fmt yuv420p)"
            ),
        };
        let (width, height) = (decoder.get_width(), decoder.get_height());
        let rate = decoder.get_framerate();
        if width == 0 || height == 0 || rate.num == 0 || rate.den == 0 {
            bail!(
                "its header tells {width} x {height} pixels and {}/{} frames per second: export it again",
                rate.num,
                rate.den
            );
        }
        let mut words = decoder.get_raw_params().split(|&byte| byte == b' ');
        let full_range = words.any(|word| word == b"XCOLORRANGE=FULL");
        Ok(Self {
            decoder,
            chroma,
            full_range,
            since_frame,
        })
    }

    /// Frames per second.
    pub fn frames_per_s(&self) -> f64 {
        let rate = self.decoder.get_framerate();
        rate.num as f64 / rate.den as f64
    }
}

impl<R: Read> Iterator for Yuv4Mpeg<R> {
    type Item = Result<Picture>;

    fn next(&mut self) -> Option<Self::Item> {
        let size = (self.decoder.get_width(), self.decoder.get_height());
        self.since_frame.set(0);
        Some(match self.decoder.read_frame() {
            Ok(frame) => Ok(picture(&frame, size, self.chroma, self.full_range)),
            // The reader tells the end of the stream and the end within a frame alike.
            Err(Error::EOF) if self.since_frame.get() == 0 => return None,
            Err(Error::EOF) => Err(anyhow::anyhow!(
                "it ends within a frame: copy it again from where it came"
            )),
            Err(Error::IoError(error)) => Err(error.into()),
            Err(error) => Err(anyhow::anyhow!(
                "a frame of it cannot be read ({error}): copy it again from where it came"
            )),
        })
    }
}

/// Refuses a header whose frames are larger than any picture that is read: the `y4m` crate multiplies their sides, which
/// may overflow.
fn check_size(header: &[u8]) -> Result<()> {
    for word in header.split(|byte| byte.is_ascii_whitespace()) {
        let Some((b'W' | b'H', digits)) = word.split_first() else {
            continue;
        };
        // What is no number is for the decoder to refuse.
        if let Ok(side) = String::from_utf8_lossy(digits).parse::<u64>()
            && side > MAX_PICTURE_SIDE_PX.into()
        {
            bail!(
                "its frames have {side} pixels along a side, at most {MAX_PICTURE_SIDE_PX} can be read: make them smaller"
            );
        }
    }
    Ok(())
}

/// Counts what is read.
struct Counted<R> {
    source: Chain<Cursor<Vec<u8>>, BufReader<R>>,
    count: Rc<Cell<usize>>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.source.read(buffer)?;
        self.count.set(self.count.get() + read);
        Ok(read)
    }
}

/// The picture of a frame by ITU-R BT.601, each sample of colour repeated over the pixels it stands for.
fn picture(
    frame: &Frame<'_>,
    (width, height): (usize, usize),
    chroma: Option<[usize; 2]>,
    full_range: bool,
) -> Picture {
    let (offset, luma_gain, chroma_gain) = if full_range {
        (0.0, 1.0, 1.0)
    } else {
        (16.0, 255.0 / 219.0, 255.0 / 224.0)
    };
    Picture::from_fn(width, height, |x, y| {
        let luma = (f32::from(frame.get_y_plane()[y * width + x]) - offset) * luma_gain;
        let [blue, red] = match chroma {
            None => [0.0; 2],
            Some([across, down]) => {
                let sample = y / down * width.div_ceil(across) + x / across;
                [frame.get_u_plane(), frame.get_v_plane()].map(|plane| (f32::from(plane[sample]) - 128.0) * chroma_gain)
            }
        };
        let rgb = [
            luma + 1.402 * red,
            luma - 0.344_136 * blue - 0.714_136 * red,
            luma + 1.772 * blue,
        ];
        rgb.map(|value| value.round().clamp(0.0, 255.0) as u8)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(bytes: &[u8]) -> Vec<Result<Picture>> {
        Yuv4Mpeg::new(bytes).unwrap().collect()
    }

    #[test]
    fn the_primaries_of_bt_601_come_back() {
        // (Y, Cb, Cr) of white, black, red, green and blue in the 16 to 235 range, from the standard.
        let colors = [
            ([235, 128, 128], [255, 255, 255]),
            ([16, 128, 128], [0, 0, 0]),
            ([81, 90, 240], [255, 0, 0]),
            ([145, 54, 34], [0, 255, 0]),
            ([41, 240, 110], [0, 0, 255]),
        ];
        let mut stream = b"YUV4MPEG2 W5 H1 F25:2 Ip C444\nFRAME\n".to_vec();
        for plane in 0..3 {
            stream.extend(colors.map(|(yuv, _)| yuv[plane]));
        }
        let video = Yuv4Mpeg::new(stream.as_slice()).unwrap();
        assert_eq!(video.frames_per_s(), 12.5);
        let frame = frames(&stream).pop().unwrap().unwrap();
        for (x, (_, rgb)) in colors.iter().enumerate() {
            // The standard's samples are whole numbers: half a level of colour is up to two of a primary.
            assert!(
                (0..3).all(|k| frame.pixel(x, 0)[k].abs_diff(rgb[k]) <= 2),
                "{:?} for {rgb:?}",
                frame.pixel(x, 0)
            );
        }
    }

    #[test]
    fn samples_of_colour_stand_for_two_by_two_pixels_also_at_an_odd_end() {
        // 3 x 3 pixels of one grey; of the four samples of colour the last is red.
        let mut stream = b"YUV4MPEG2 W3 H3 F30:1 C420jpeg XCOLORRANGE=FULL\nFRAME\n".to_vec();
        stream.extend([100; 9]);
        stream.extend([128; 4]);
        stream.extend([128, 128, 128, 178]);
        let frame = frames(&stream).pop().unwrap().unwrap();
        for pixel in 0..9 {
            let red = if pixel == 8 { 170 } else { 100 };
            assert_eq!(frame.pixel(pixel % 3, pixel / 3)[0], red, "pixel {pixel}");
        }
        assert_eq!(frame.pixel(0, 0), [100; 3]);
    }

    #[test]
    fn a_stream_ends_after_a_frame_and_not_within_one() {
        let header = b"YUV4MPEG2 W4 H2 F30:1 Cmono\n".as_slice();
        let frame = [b"FRAME\n".as_slice(), &[128; 8]].concat();
        let whole = [header, &frame, &frame].concat();
        assert!(frames(&whole).iter().all(Result::is_ok) && frames(&whole).len() == 2);
        for cut in [1, 7, 10] {
            let cut = frames(&whole[..whole.len() - cut]);
            assert_eq!(cut.len(), 2);
            assert!(cut[1].as_ref().unwrap_err().to_string().contains("within a frame"));
        }
        for (bytes, cause) in [
            (b"RIFF1234\n".as_slice(), "header"),
            (b"", "ends before"),
            (b"YUV4MPEG2 W4 H2 F30:1 C420p10\n", "8 bits"),
            (b"YUV4MPEG2 W4 H2 F0:0 Cmono\n", "frames per second"),
            // Their product is 0 modulo 2^64.
            (b"YUV4MPEG2 W4294967296 H4294967296 F30:1 Cmono\n", "4294967296 pixels"),
            (b"YUV4MPEG2 W2 H99999999999999999999 F30:1 Cmono\n", "header"),
            (b"YUV4MPEG2 W16384 H16384 F30:1 C444\n", "256 MiB"),
        ] {
            let error = Yuv4Mpeg::new(bytes).err().unwrap().to_string();
            assert!(error.contains(cause), "{error}");
        }
    }
}
