//! What a command leaves in a folder, without what differs from run to run: times, and the command line.

use anyhow::{Context, Result};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Files by their paths in a folder.
pub type Files = BTreeMap<String, Vec<u8>>;

/// All files of `folder`; `None` where there is no folder.
pub fn files(folder: &Path) -> Result<Option<Files>> {
    if fs::symlink_metadata(folder).is_err() {
        return Ok(None);
    }
    let (mut files, mut folders) = (Files::new(), vec![folder.to_path_buf()]);
    while let Some(inside) = folders.pop() {
        let listing = fs::read_dir(&inside).with_context(|| format!("listing {}", inside.display()))?;
        for entry in listing {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder)?.to_string_lossy().replace('\\', "/");
                files.insert(
                    name,
                    fs::read(&path).with_context(|| format!("reading {}", path.display()))?,
                );
            }
        }
    }
    Ok(Some(files))
}

/// Copies a folder.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    for (name, bytes) in files(from)?.with_context(|| format!("{} is not there", from.display()))? {
        let path = to.join(name);
        fs::create_dir_all(path.parent().context("a file lies in a folder")?)?;
        fs::write(path, bytes)?;
    }
    Ok(())
}

/// The same files without what differs between two runs of one command: how long it took, and how it was called.
pub fn without_times(files: Files) -> Result<Files> {
    let strip = |(name, bytes): (String, Vec<u8>)| {
        let base = name.rsplit('/').next().unwrap_or_default();
        let bytes = match base {
            "track.json" | "report.json" => without_fields(&bytes, &["ms", "median_ms", "stage_ms"])?,
            "model.json" => without_fields(&bytes, &["seconds", "command"])?,
            "track.csv" => table(&bytes, |name| name.ends_with("_ms"), str::to_owned),
            // A resumed training has read its curve from JSON, which may change the last bit of a number.
            "curve.csv" => table(&bytes, |name| name == "seconds", ten_digits),
            "CARD.md" => without_lines(&bytes, &["    deepsft ", "| hours |", "| 0 |", "| samples | hours |"]),
            // Drawn over hours.
            "curve.png" => Vec::new(),
            _ => bytes,
        };
        Ok((name, bytes))
    };
    files.into_iter().map(strip).collect()
}

fn without_fields(json: &[u8], names: &[&str]) -> Result<Vec<u8>> {
    fn strip(value: &mut Value, names: &[&str]) {
        match value {
            Value::Object(fields) => {
                fields.retain(|name, _| !names.contains(&name.as_str()));
                fields.values_mut().for_each(|value| strip(value, names));
            }
            Value::Array(values) => values.iter_mut().for_each(|value| strip(value, names)),
            _ => {}
        }
    }
    let mut value = serde_json::from_slice(json).context("a report is no JSON")?;
    strip(&mut value, names);
    Ok(serde_json::to_vec(&value)?)
}

/// A table without some of its columns, and each cell as `cell` gives it.
fn table(table: &[u8], is_left_out: impl Fn(&str) -> bool, cell: impl Fn(&str) -> String) -> Vec<u8> {
    let text = String::from_utf8_lossy(table);
    let names: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let kept = |line: &str| {
        let cells = line.split(',').zip(&names).filter(|(_, name)| !is_left_out(name));
        cells.map(|(text, _)| cell(text)).collect::<Vec<_>>().join(",") + "\n"
    };
    text.lines().map(kept).collect::<String>().into_bytes()
}

fn ten_digits(number: &str) -> String {
    let parsed = number.parse::<f64>();
    parsed.map_or_else(|_| number.to_owned(), |number| format!("{number:.9e}"))
}

fn without_lines(text: &[u8], beginnings: &[&str]) -> Vec<u8> {
    let text = String::from_utf8_lossy(text);
    let lines = text
        .lines()
        .filter(|line| !beginnings.iter().any(|begin| line.starts_with(begin)));
    lines.collect::<Vec<_>>().join("\n").into_bytes()
}

/// The first difference between two folders, for people; `None` when they are equal.
pub fn difference(found: &Files, expected: &Files) -> Option<String> {
    for (name, bytes) in expected {
        match found.get(name) {
            None => return Some(format!("{name} is missing")),
            Some(other) if other != bytes => {
                let place = other.iter().zip(bytes).take_while(|(a, b)| a == b).count();
                let (found, expected) = (other.len(), bytes.len());
                return Some(format!(
                    "{name} differs from byte {place} on; {found} bytes, expected {expected}"
                ));
            }
            Some(_) => {}
        }
    }
    let more = found.keys().find(|name| !expected.contains_key(*name))?;
    Some(format!("{more} should not be there"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, text: &str) -> Files {
        Files::from([(name.to_owned(), text.as_bytes().to_vec())])
    }

    #[test]
    fn times_and_the_command_line_do_not_count_and_all_else_does() {
        let equal = |name: &str, one: &str, other: &str| {
            let [one, other] = [one, other].map(|text| without_times(of(name, text)).unwrap());
            difference(&one, &other).is_none()
        };
        let track = |ms: f64, found: bool| format!(r#"{{"per_frame":[{{"found":{found},"ms":{{"follow":{ms}}}}}]}}"#);
        assert!(equal("track.json", &track(1.0, true), &track(2.0, true)));
        assert!(!equal("track.json", &track(1.0, true), &track(1.0, false)));
        assert!(equal(
            "track.csv",
            "frame,follow_ms,found\n0,5,true\n",
            "frame,follow_ms,found\n0,6,true\n"
        ));
        assert!(!equal(
            "track.csv",
            "frame,follow_ms,found\n0,5,true\n",
            "frame,follow_ms,found\n0,5,false\n"
        ));
        assert!(equal(
            "a/model.json",
            r#"{"provenance":{"seconds":1,"seed":2}}"#,
            r#"{"provenance":{"seconds":3,"seed":2}}"#
        ));
        assert!(!equal(
            "a/model.json",
            r#"{"provenance":{"seconds":1,"seed":2}}"#,
            r#"{"provenance":{"seconds":1,"seed":3}}"#
        ));
        assert!(!equal("weights.bpk", "one", "two"));
    }

    #[test]
    fn a_difference_is_told_with_the_file() {
        let two: Files = of("a", "1234").into_iter().chain(of("b", "12")).collect();
        assert_eq!(difference(&two, &two), None);
        let told = |found: &Files, expected: &Files| difference(found, expected).unwrap();
        assert_eq!(told(&of("a", "1234"), &two), "b is missing");
        assert_eq!(told(&two, &of("a", "1234")), "b should not be there");
        assert!(told(&of("a", "1224"), &of("a", "1234")).contains("from byte 2 on"));
    }
}
