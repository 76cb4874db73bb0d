//! The commands that the pages for readers show are commands of the program, with options it has.

use crate::common::deepsft;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// All Markdown pages in `folder`.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect()
}

/// The commands in code blocks and between backticks that begin with `deepsft `, without comments.
fn commands(text: &str) -> Vec<String> {
    let lines = text.lines().map(str::trim).filter(|line| line.starts_with("deepsft "));
    let lines = lines.map(|line| line.split(" #").next().unwrap_or_default());
    // Every second piece between backticks is code; a line break in one is a space.
    let spans = text.split('`').filter(|piece| piece.starts_with("deepsft "));
    let spans = spans.filter(|piece| !piece.contains("\n\n"));
    lines.chain(spans).map(|c| c.replace('\n', " ")).collect()
}

/// The words before the first option that are names of subcommands: lower-case words, two at most.
fn subcommands(words: &[&str]) -> Vec<String> {
    let is_name = |word: &&&str| word.chars().all(|c| c.is_ascii_lowercase());
    words
        .iter()
        .take_while(is_name)
        .take(2)
        .map(|&word| word.to_owned())
        .collect()
}

#[test]
fn every_command_and_option_in_the_pages_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut pages = pages(&root.join("www/docs"));
    pages.extend(
        [
            "README.md",
            "crates/README.md",
            "crates/HOW-TO-ADD.md",
            "crates/AWKWARD-PLACES.md",
            "crates/deepsft-cli/README.md",
            "models/poster-a4/CARD.md",
        ]
        .map(|name| root.join(name)),
    );
    let mut seen = BTreeSet::new();
    for page in &pages {
        for command in commands(&fs::read_to_string(page).unwrap()) {
            let words: Vec<&str> = command.split_whitespace().skip(1).collect();
            let mut asked = subcommands(&words);
            seen.insert(asked.clone());
            asked.push("--help".to_owned());
            let help = deepsft(&root, &asked);
            assert_eq!(help.code, 0, "{}: {command}\n{}", page.display(), help.stderr);
            let options = |line: &str| line.trim_start().starts_with('-').then(|| line.to_owned());
            let options: Vec<String> = help.stdout.lines().filter_map(options).collect();
            for option in words.iter().filter(|word| word.starts_with("--")) {
                let name = option.trim_end_matches(|c: char| !c.is_ascii_lowercase());
                let has = |line: &String| line.split([' ', ',', ']']).any(|word| word == name);
                assert!(
                    options.iter().any(has),
                    "{}: {command}: there is no {name}",
                    page.display()
                );
            }
        }
    }
    assert!(seen.len() > 8, "the pages were not read: {seen:?}");
}
