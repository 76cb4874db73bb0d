//! `deepsft-lab study cards`: of the cards of one series, all looked for, the one in view must be named and no other.

use super::frames::frames_config;
use anyhow::Result;
use clap::Args;
use deepsft::{Target, TargetFinder, View};
use deepsft_geometry::{Picture, Template};
use deepsft_synth::painting::artwork;
use deepsft_synth::rand::RngExt;
use deepsft_synth::random::{Stream, generator};
use deepsft_synth::{SynthConfig, Synthesizer};
use indicatif::ProgressBar;
use rayon::prelude::*;

/// Size of a card, pixels, and its width in mm.
const WIDTH: usize = 630;
const HEIGHT: usize = 880;
const WIDTH_MM: f64 = 210.0;

/// What all cards of the series share, as a seed.
const SERIES: u64 = 1;

/// The card that a frame shows, those that were found in it, and the number of the frame.
type Looked = (usize, Vec<usize>, u64);

#[derive(Args)]
pub struct CardsArguments {
    /// Cards of the series, all of which are looked for
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(2..=100))]
    cards: u64,
    /// Frames, each of one card
    #[arg(long, value_name = "N", default_value_t = 200)]
    frames: u64,
    /// Seed of the frames
    #[arg(long, value_name = "S", default_value_t = 4242)]
    seed: u64,
}

/// A card: border, type line and foot are the same on all, title, picture and text are its own.
fn card(number: u64) -> Picture {
    let mut pixels = vec![[236, 226, 200]; WIDTH * HEIGHT];
    // Tiles of one side over an area, with a seed and the chance of ink; letters have a blank column and row after each.
    let mut tiles = |[x, y, w, h]: [usize; 4], side: usize, seed: u64, ink: f64, is_text: bool| {
        let mut random = generator(seed, side as u64, Stream::Pool);
        for (row, column) in (0..h / side).flat_map(|row| (0..w / side).map(move |column| (row, column))) {
            let blank = is_text && (row % 7 > 4 || column % 4 == 3);
            let shade: u8 = random.random_range(20..140);
            if random.random_bool(ink) && !blank {
                for pixel in 0..side * side {
                    let at = (y + row * side + pixel / side) * WIDTH + x + column * side + pixel % side;
                    pixels[at] = if is_text { [30; 3] } else { [shade, shade / 2 + 20, 40] };
                }
            }
        }
    };
    for border in [
        [0, 0, WIDTH, 40],
        [0, HEIGHT - 40, WIDTH, 40],
        [0, 40, 40, HEIGHT - 80],
        [WIDTH - 40, 40, 40, HEIGHT - 80],
    ] {
        tiles(border, 10, SERIES + border[0] as u64, 0.6, false);
    }
    tiles([65, 60, 500, 35], 7, 1000 + number, 0.5, true);
    tiles([65, 530, 500, 25], 5, SERIES + 1, 0.5, true);
    tiles([65, 590, 500, 196], 4, 2000 + number, 0.5, true);
    tiles([65, 800, 500, 36], 12, SERIES + 2, 0.5, false);
    let mut random = generator(3000 + number, 3, Stream::Pool);
    let (_, art) = artwork([0, 1, 2, 4, 6, 8][number as usize % 6], &mut random);
    for (x, y) in (0..380).flat_map(|y| (0..520).map(move |x| (x, y))) {
        let at = |place: usize, of: usize, size: usize| (place as f64 + 0.5) / of as f64 * size as f64;
        let color = art.sample(at(x, 520, art.width()), at(y, 380, art.height()));
        pixels[(y + 130) * WIDTH + x + 55] = color.map(|channel| channel as u8);
    }
    Picture::from_fn(WIDTH, HEIGHT, |x, y| pixels[y * WIDTH + x])
}

fn template(number: u64) -> Result<Template> {
    Ok(Template::thin_shell(
        card(number),
        WIDTH_MM,
        WIDTH_MM * HEIGHT as f64 / WIDTH as f64,
    )?)
}

fn config() -> Result<SynthConfig> {
    let mut config = frames_config()?;
    config.min_visible_px *= 4;
    Ok(config)
}

/// Looks for all cards in frames that show one each, bent, tilted, partly hidden, and prints which were found.
pub fn run(arguments: &CardsArguments) -> Result<()> {
    let config = config()?;
    let cards = (0..arguments.cards).map(template).collect::<Result<Vec<_>>>()?;
    let progress = ProgressBar::new(arguments.frames);
    let threads = rayon::current_num_threads() as u64;
    let looked = (0..threads).into_par_iter().map(|thread| -> Result<Vec<Looked>> {
        let targets = cards
            .iter()
            .map(|card| TargetFinder::new(Target::from_template(card.clone())));
        let mut finders = targets.collect::<Result<Vec<_>, _>>()?;
        for k in 1..finders.len() {
            let (before, now) = finders.split_at_mut(k);
            let shares = before.iter_mut().map(|other| now[0].tell_apart(other));
            let (least, most) = shares.fold((1.0_f64, 0.0_f64), |(least, most), share| {
                (least.min(share), most.max(share))
            });
            if thread == 0 {
                println!(
                    "card {k} shares {:.0} to {:.0} % of its corners",
                    100.0 * least,
                    100.0 * most
                );
            }
        }
        let frames = (thread..arguments.frames).step_by(threads as usize).map(|frame| {
            let shown = (frame % arguments.cards) as usize;
            let sample = Synthesizer::new(&cards[shown], config.clone())?.sample(arguments.seed, frame);
            let mut view = View::new(&sample.image, &config.camera);
            let mut found = Vec::new();
            for (k, finder) in finders.iter_mut().enumerate() {
                if pollster::block_on(finder.estimate(&mut view))?.judgement.found {
                    found.push(k);
                }
            }
            progress.inc(1);
            Ok((shown, found, frame))
        });
        frames.collect()
    });
    let looked: Vec<_> = looked.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    let count = |is: &dyn Fn(&Looked) -> bool| looked.iter().filter(|frame| is(frame)).count();
    let found = count(&|(_, found, _)| !found.is_empty());
    let right = count(&|(shown, found, _)| found.contains(shown));
    println!(
        "{} frames, a card found in {found}, the right one in {right} ({:.1} %)",
        looked.len(),
        100.0 * right as f64 / found.max(1) as f64
    );
    println!(
        "a wrong one in {}, two or more in {}",
        count(&|(shown, found, _)| found.iter().any(|k| k != shown)),
        count(&|(_, found, _)| found.len() > 1)
    );
    for (shown, found, frame) in looked.iter().filter(|(shown, found, _)| found[..] != [*shown]) {
        println!("frame {frame} shows card {shown}, found {found:?}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::Judgement;
    use deepsft_finding::{FeatureFinder, Features};

    #[test]
    fn a_card_of_fine_print_is_found_before_a_pattern_and_among_matches_half_of_which_are_wrong() -> Result<()> {
        let config = config()?;
        let before_pattern = [(1, 13), (6, 18), (8, 128), (4, 148), (1, 169), (4, 184)];
        let among_wrong = [(10, 70), (10, 118), (11, 143)];
        let is_found = before_pattern.into_iter().chain(among_wrong).map(|(shown, frame)| {
            let card = template(shown)?;
            let sample = Synthesizer::new(&card, config.clone())?.sample(4242, frame);
            let (features, camera) = Features::of(&sample.image, &config.camera)?;
            Ok(FeatureFinder::new(card)?.find(&features, &camera)?.is_some())
        });
        let is_found = is_found.collect::<Result<Vec<_>>>()?;
        assert!(is_found.iter().all(|&is| is), "{is_found:?}");
        Ok(())
    }

    #[test]
    fn a_card_that_lies_off_before_close_ups_is_found_and_one_by_its_frame_alone_is_not() -> Result<()> {
        let config = config()?;
        for (shown, sought, frame) in [(11, 11, 59), (7, 7, 67), (3, 9, 195)] {
            let mut finder = TargetFinder::new(Target::from_template(template(sought)?))?;
            let mut others = Vec::new();
            for other in (0..12).filter(|other| *other != sought) {
                let mut other = TargetFinder::new(Target::from_template(template(other)?))?;
                assert!(finder.tell_apart(&mut other) > 0.15);
                others.push(other);
            }
            let sample = Synthesizer::new(&template(shown)?, config.clone())?.sample(4242, frame);
            let mut view = View::new(&sample.image, &config.camera);
            let estimate = pollster::block_on(finder.estimate(&mut view))?;
            let Judgement { found, .. } = estimate.judgement;
            assert_eq!(found, shown == sought, "{frame}: {:?}", estimate.judgement);
        }
        Ok(())
    }
}
