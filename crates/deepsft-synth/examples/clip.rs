//! Renders the demo page's clip: numbered PNG frames and `clip.json`, into the folder given as second argument, of
//! the template texture given as first (an A4 sheet). The page's video is made of them by
//!
//! ```sh
//! cargo run --release -p deepsft-synth --example clip -- models/poster-a4/template/texture.png clip
//! ffmpeg -framerate 30 -i clip/%04d.png -c:v libvpx -b:v 3M -crf 12 www/demo/clip.webm && cp clip/clip.json www/demo/
//! ```

use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{ClipConfig, ClipMotion, FIRST_CLIP_SEED, SynthConfig, Synthesizer};
use std::path::Path;

const FRAMES: usize = 240;
const FRAMES_PER_SECOND: usize = 30;
const SEED: u64 = FIRST_CLIP_SEED + 1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [texture, folder] = arguments.as_slice() else {
        return Err("usage: clip TEXTURE.png FOLDER".into());
    };
    let texture = image::open(texture)?.to_rgb8();
    let (width, height) = (texture.width() as usize, texture.height() as usize);
    let template = Template::thin_shell(Picture::new(width, height, texture.into_raw())?, 297.0, 210.0)?;
    let camera = training_camera().resized(960, 540)?;
    let synthesizer = Synthesizer::new(&template, SynthConfig::for_clips(camera))?;
    let scene = synthesizer.scene(SEED, 0);
    let motion = ClipMotion::new(&template, &camera, ClipConfig::default(), SEED);
    std::fs::create_dir_all(folder)?;
    for frame in 0..FRAMES {
        let vertices = motion.vertices_camera(frame as f64 / FRAMES as f64);
        let picture = scene.render(vertices, frame as u64)?.image;
        let (width, height) = (picture.width() as u32, picture.height() as u32);
        let path = Path::new(folder).join(format!("{frame:04}.png"));
        image::save_buffer(path, picture.rgb(), width, height, image::ColorType::Rgb8)?;
    }
    let (focal, centre) = (camera.focal(), camera.principal_point());
    let description = format!(
        "{{\"camera\": {{\"width\": 960, \"height\": 540, \"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {}}}, \
         \"fps\": {FRAMES_PER_SECOND}, \"seed\": {SEED}, \"synthetic\": true}}\n",
        focal.x, focal.y, centre.x, centre.y
    );
    std::fs::write(Path::new(folder).join("clip.json"), description)?;
    Ok(())
}
