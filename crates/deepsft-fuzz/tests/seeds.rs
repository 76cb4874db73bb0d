//! The inputs from which mutations begin.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use deepsft_fuzz::{TARGETS, Target};

#[test]
fn every_seed_is_read() {
    for Target { name, read, seeds } in &TARGETS {
        let seeds = seeds().unwrap();
        assert!(!seeds.is_empty(), "{name} has no seeds");
        for (number, seed) in seeds.iter().enumerate() {
            if let Err(error) = read(seed) {
                panic!("seed {number} of {name}: {error:#}");
            }
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
