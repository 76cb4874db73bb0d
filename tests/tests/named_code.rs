//! The map and the pages beside it name code that is there: what stands in backticks occurs in a file that is linked in the same sentence.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Cells of tables, list items and paragraphs, each in one line; code blocks are left out.
fn passages(text: &str) -> Vec<String> {
    let (mut passages, mut inside) = (vec![String::new()], false);
    for line in text.lines().map(str::trim) {
        let fence = line.starts_with("```");
        inside ^= fence;
        if inside || fence {
            continue;
        }
        if let Some(row) = line.strip_prefix('|') {
            passages.extend(row.split('|').map(str::to_owned));
        } else if line.is_empty() || line.starts_with(['*', '#', '-']) {
            passages.push(line.to_owned());
        } else if let Some(last) = passages.last_mut() {
            *last += &format!(" {line}");
        }
    }
    passages
}

/// A passage without the places where its links lead, and these places. A link begins with `[`.
fn without_targets(passage: &str) -> (String, Vec<&str>) {
    let mut parts = passage.split("](");
    let mut text = parts.next().unwrap_or_default().to_owned();
    let mut targets = Vec::new();
    for part in parts {
        let (target, behind) = part.split_once(')').unwrap_or((part, ""));
        targets.push(target);
        text += behind;
    }
    (text, targets)
}

/// The names of code in backticks, in each sentence that has a link. Files, options and commands of several words are none.
fn names(passage: &str) -> Vec<String> {
    let is_word = |word: &str| {
        let starts = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        starts && word.chars().all(|c| c.is_alphanumeric() || c == '_')
    };
    let mut names = Vec::new();
    for sentence in passage.split(". ").filter(|sentence| sentence.contains('[')) {
        for code in sentence.split('`').skip(1).step_by(2) {
            let words: Vec<&str> = code.trim_end_matches("()").split("::").collect();
            if words.iter().all(|word| is_word(word)) {
                names.extend(words.into_iter().map(str::to_owned));
            }
        }
    }
    names
}

/// The words of a file, or of all files below a folder.
fn words(place: &Path, words_there: &mut BTreeSet<String>) {
    if place.is_dir() {
        for entry in fs::read_dir(place).unwrap() {
            words(&entry.unwrap().path(), words_there);
        }
    } else if let Ok(text) = fs::read_to_string(place) {
        let all = text.split(|c: char| !c.is_alphanumeric() && c != '_');
        words_there.extend(all.map(str::to_owned));
    }
}

/// The names in a page that no file beside them has, and how many were looked for. Links lead from `folder`.
fn missing(page: &str, folder: &Path) -> (Vec<String>, usize) {
    let (mut missing, mut seen) = (Vec::new(), 0);
    for passage in passages(page) {
        let (text, targets) = without_targets(&passage);
        let places = targets
            .iter()
            .map(|target| folder.join(target.split('#').next().unwrap_or_default()));
        let mut there = BTreeSet::new();
        places.for_each(|place| words(&place, &mut there));
        for name in names(&text) {
            seen += 1;
            if !there.contains(&name) && !folder.join(&name).is_dir() {
                missing.push(format!("`{name}` is in none of {targets:?}"));
            }
        }
    }
    (missing, seen)
}

#[test]
fn names_of_code_in_the_map_and_the_pages_beside_it_are_in_the_files_that_are_linked() {
    let folder = deepsft_tests::root().join("crates");
    for (page, least) in [("README.md", 10), ("HOW-TO-ADD.md", 60), ("AWKWARD-PLACES.md", 5)] {
        let text = fs::read_to_string(folder.join(page)).unwrap();
        let (missing, seen) = missing(&text, &folder);
        assert!(missing.is_empty(), "{page}: {missing:#?}");
        assert!(seen > least, "only {seen} names were seen: {page} was not read");
    }
}

#[test]
fn a_name_that_is_not_there_is_missed() {
    let folder = deepsft_tests::root().join("tests");
    let missed = |page: &str| missing(page, &folder).0.len();
    for page in [
        "[`layering.rs`](tests/layering.rs) has `complaint` and `Imports::of`, with `--offline` and `cargo xtask`",
        "| [here](tests) | `NoSuchName` has no link | [`sources`](tests/layering.rs) |",
        "First `NoSuchName`. Then [here](tests/layering.rs). And `NoSuchName` in a sentence of its own.",
        "```\n[here](tests/layering.rs) `NoSuchName`\n```",
    ] {
        assert_eq!(missed(page), 0, "{page}");
    }
    for page in [
        "[here](tests/layering.rs) is `complaints`",
        "| a | as [`NoSuchName`](tests/layering.rs) |",
        "A field of `NoSuchName` ([here](tests/layering.rs))",
        "* Both [here](tests/layering.rs)\n  and there `imports::no_such_name()`.",
    ] {
        assert_eq!(missed(page), 1, "{page}");
    }
}
