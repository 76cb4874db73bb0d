//! The inputs from which mutations begin.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_fuzz::{TARGETS, Target};

/// Seeds that are refused: palettes that end within a colour, a needle longer than texels can be counted.
const REFUSED: [(&str, usize); 3] = [("picture", 8), ("picture", 9), ("ply", 2)];

#[test]
fn every_seed_is_read_but_those_that_once_ended_a_reader() {
    for Target { name, read, seeds } in &TARGETS {
        let seeds = seeds().unwrap();
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for (number, seed) in seeds.iter().enumerate() {
            let refused = read(seed).err().map(|error| format!("{error:#}"));
            assert_eq!(
                refused.is_some(),
                REFUSED.contains(&(*name, number)),
                "seed {number} of {name}: {refused:?}"
            );
        }
    }
}

#[test]
fn inputs_that_are_no_files_are_refused_in_words() {
    for Target { name, read, .. } in &TARGETS {
        for input in [&b""[..], b"\n<part>\n", b"no file at all"] {
            let error = read(input).unwrap_err();
            assert!(format!("{error:#}").len() > 10, "{name}: {error:#}");
        }
    }
}

#[test]
fn planted_bugs_are_targets_of_their_own() {
    for name in ["planted-panic", "planted-memory"] {
        let planted = Target::named(name).unwrap();
        assert!((planted.read)(b"a word").is_err());
        assert!(TARGETS.iter().all(|target| target.name != name));
    }
    assert!(Target::named("no-such-target").is_none());
}
