//! The options of synthetic images.

use crate::synthesis::{Preset, SynthesisOptions, synthesizer};
use deepsft_geometry::{Picture, Template};
use deepsft_synth::EffectsConfig;

#[test]
fn the_name_of_a_set_says_what_is_not_the_default() {
    assert_eq!(SynthesisOptions::default().note(), "");
    assert_eq!(SynthesisOptions::default().options(), "");
    let options = SynthesisOptions {
        images: Preset::Paper,
        camera_effects: true,
        backgrounds: Some("rooms".into()),
        max_roll: None,
    };
    assert_eq!(
        options.note(),
        ", the paper's ranges, with camera effects, before photographs of rooms"
    );
    assert_eq!(
        options.options(),
        " --images paper --camera-effects --backgrounds rooms"
    );
}

#[test]
fn the_greatest_roll_is_that_of_the_poses() {
    let template = Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap();
    let greatest = |max_roll| {
        let options = SynthesisOptions {
            max_roll,
            ..SynthesisOptions::default()
        };
        synthesizer(&template, &options).unwrap().config().pose.max_roll_deg
    };
    assert_eq!((greatest(None), greatest(Some(45.0))), (180.0, 45.0));
}

#[test]
fn camera_effects_leave_a_preset_its_gain() {
    let texture = Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]);
    let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
    let effects = |images: Preset| {
        let options = SynthesisOptions {
            images,
            camera_effects: true,
            ..SynthesisOptions::default()
        };
        synthesizer(&template, &options).unwrap().config().effects.clone()
    };
    let (paper, default) = (effects(Preset::Paper), EffectsConfig::default());
    assert_eq!(
        (paper.gain, paper.jpeg_probability),
        ([0.9, 1.1], default.jpeg_probability)
    );
    assert_eq!(effects(Preset::Default).gain, default.gain);
}
