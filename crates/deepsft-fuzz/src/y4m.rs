//! Uncompressed video.

use crate::picture;
use anyhow::Result;
use deepsft_cli::Yuv4Mpeg;

pub(crate) fn read(input: &[u8]) -> Result<()> {
    let video = Yuv4Mpeg::new(input)?;
    let rate = video.frames_per_s();
    assert!(rate.is_finite() && rate > 0.0, "{rate} frames per second");
    let mut size = None;
    for frame in video {
        let frame = frame?;
        let expected = *size.get_or_insert(frame.size());
        assert_eq!(frame.size(), expected, "frames of several sizes");
    }
    Ok(())
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let picture = picture::small(3, 3);
    let plane = &picture.rgb()[..9];
    let video = |header: &str, frame: &[u8]| {
        let frame = [b"FRAME\n", frame].concat();
        [header.as_bytes(), &frame, &frame].concat()
    };
    Ok(vec![
        video(
            "YUV4MPEG2 W3 H3 F30:1 Ip A1:1 C420jpeg XCOLORRANGE=FULL\n",
            &[plane, &[128; 8]].concat(),
        ),
        video("YUV4MPEG2 W3 H3 F30000:1001 C422\n", &[plane, &[100; 12]].concat()),
        video("YUV4MPEG2 W3 H3 F25:2 C444\n", &[plane, plane, plane].concat()),
        video("YUV4MPEG2 W3 H3 F25:1 Cmono\n", plane),
        video("YUV4MPEG2 W3 H3\n", &[plane, &[128; 8]].concat()),
    ])
}
