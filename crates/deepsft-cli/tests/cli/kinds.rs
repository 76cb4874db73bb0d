//! What people bring: one small file of each kind, in `tests/kinds`, and what becomes of it on the command line. `kinds.json` there says
//! what is expected, of the page too.

use crate::common::deepsft;
use serde::Deserialize;
use std::fs;
use std::path::Path;

const INVALID_INPUT: i32 = 3;

#[derive(Deserialize)]
struct Kinds {
    outcomes: Vec<Expected>,
}

#[derive(Deserialize)]
struct Expected {
    file: String,
    is: String,
    cli: Option<Outcome>,
}

/// What becomes of a file: it is read, with these words said, or refused with these words.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Outcome {
    Read(Vec<String>),
    Refused(Vec<String>),
}

/// The command that reads a file of this kind.
fn command(kind: &str) -> &str {
    match kind {
        "picture" => "template new --size-mm 40x30 --out sheet --image",
        "scan" => "template import --out scan",
        "sheet" => "template import --sheet --out sheet",
        "camera" => "camera import --out read.json",
        "board" => "camera calibrate --checkerboard --out c.json",
        "video" => "track --picture print.png --size-mm 40x30 --out track",
        _ => panic!("{kind}"),
    }
}

#[test]
fn each_kind_of_file_is_read_or_refused_with_file_cause_and_remedy() {
    let made = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/kinds");
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for entry in fs::read_dir(&made).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.join(entry.file_name())).unwrap();
    }
    let kinds: Kinds = serde_json::from_slice(&fs::read(made.join("kinds.json")).unwrap()).unwrap();
    for Expected { file, is, cli } in kinds.outcomes {
        let Some(cli) = cli else { continue };
        let arguments: Vec<&str> = command(&is).split(' ').chain([file.as_str()]).collect();
        let run = deepsft(folder, &arguments);
        let (code, words) = match cli {
            Outcome::Read(words) => (0, words),
            Outcome::Refused(words) => (INVALID_INPUT, words),
        };
        assert_eq!(run.code, code, "{is} {file}: {run:?}");
        let said = format!("{}{}", run.stdout, run.stderr);
        for words in words {
            assert!(said.contains(&words), "{is} {file}: {words:?} is not in {said}");
        }
        if code != 0 {
            let refusals: Vec<_> = run.stderr.lines().filter(|line| line.starts_with("error: ")).collect();
            assert!(
                refusals.len() == 1 && refusals[0].contains(&file),
                "{is} {file}: {}",
                run.stderr
            );
            println!("{}", run.stderr.trim());
        }
    }
}
