//! Which file of a crate imports which, from the text of its sources.

use std::collections::{BTreeMap, BTreeSet};

/// The imports between the files of one crate.
#[derive(Debug)]
pub struct Imports {
    /// Files and the files that each of them imports.
    pub files: BTreeMap<String, BTreeSet<String>>,
}

/// A module: its file, and the names that `use` brings into it, with the paths they stand for.
struct Module {
    file: String,
    names: BTreeMap<String, Vec<String>>,
}

/// A path in a source text, without the names of its re-export.
struct Path {
    segments: Vec<String>,
    alias: String,
    /// Whether it stands in a `use`, and one with `pub`.
    used: bool,
    public: bool,
}

impl Imports {
    /// Of the sources of a crate: names below `src`, and texts. A re-export is no import of the module that has it; who takes a name
    /// from there imports the file where it comes from. Tests within the sources do not count.
    pub fn of<'a>(sources: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let sources: Vec<(&str, Vec<String>, Vec<Path>)> = (sources.into_iter())
            .map(|(file, text)| (file, module_of(file), paths(text)))
            .collect();
        let mut modules: BTreeMap<Vec<String>, Module> = BTreeMap::new();
        for (file, module, _) in &sources {
            let (file, names) = ((*file).to_owned(), BTreeMap::new());
            modules.insert(module.clone(), Module { file, names });
        }
        let known: BTreeSet<Vec<String>> = modules.keys().cloned().collect();
        for (_, module, paths) in &sources {
            for path in paths.iter().filter(|path| path.used) {
                if let (Some(whole), Some(at)) = (absolute(module, &path.segments, &known), modules.get_mut(module)) {
                    at.names.insert(path.alias.clone(), whole);
                }
            }
        }
        let mut files: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (file, module, paths) in &sources {
            let imported = files.entry((*file).to_owned()).or_default();
            for path in paths.iter().filter(|path| !path.public) {
                let whole = absolute(module, &path.segments, &known);
                let from = whole.and_then(|whole| origin(&modules, &whole, 8));
                imported.extend(from.filter(|from| from != file));
            }
        }
        Self { files }
    }

    /// Pairs of files that import each other.
    pub fn mutual(&self) -> Vec<String> {
        let imports = |a: &str, b: &str| self.files.get(a).is_some_and(|imported| imported.contains(b));
        let pairs = self.files.iter().flat_map(|(a, imported)| {
            let back = imported.iter().filter(move |b| a < *b && imports(b, a));
            back.map(move |b| format!("{a} <-> {b}"))
        });
        pairs.collect()
    }

    /// Groups of folders side by side that reach each other.
    pub fn circles_of_folders(&self) -> Vec<String> {
        let folders: BTreeSet<&str> = (self.files.keys())
            .flat_map(|file| file.match_indices('/').map(|(at, _)| &file[..at]))
            .collect();
        // A folder's own file, `a.rs` or `a/mod.rs`, belongs to it.
        let is_in = |file: &str, folder: &str| {
            let rest = file.strip_prefix(folder);
            rest.is_some_and(|rest| rest.starts_with('/') || rest == ".rs")
        };
        let parent = |folder: &str| folder.rsplit_once('/').map_or("", |(parent, _)| parent).to_owned();
        let imports = |a: &str, b: &str| {
            let mut files = self.files.iter().filter(|(file, _)| is_in(file, a));
            files.any(|(_, imported)| imported.iter().any(|file| is_in(file, b)))
        };
        let mut reached: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for a in &folders {
            let beside = folders.iter().filter(|b| *b != a && parent(b) == parent(a));
            reached.insert(a, beside.copied().filter(|b| imports(a, b)).collect());
        }
        for _ in 0..folders.len() {
            for a in &folders {
                let further: BTreeSet<&str> = reached[a].iter().flat_map(|b| reached[b].clone()).collect();
                reached.entry(a).or_default().extend(further);
            }
        }
        let circle = |a: &&str| -> Option<String> {
            let back: Vec<&str> = (reached[a].iter().copied())
                .filter(|b| reached[b].contains(a))
                .collect();
            (back.len() > 1 && back[0] == *a).then(|| {
                back.iter()
                    .map(|name| format!("{name}/"))
                    .collect::<Vec<_>>()
                    .join(" <-> ")
            })
        };
        folders.iter().filter_map(circle).collect()
    }
}

/// The path of the module that a file is.
fn module_of(file: &str) -> Vec<String> {
    let mut module: Vec<String> = file.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if module.last().is_some_and(|name| name == "mod") || ["lib", "main"].contains(&module.join("/").as_str()) {
        module.pop();
    }
    module
}

/// A path of a module from the root of its crate; `None` where it leads to another crate.
fn absolute(module: &[String], path: &[String], known: &BTreeSet<Vec<String>>) -> Option<Vec<String>> {
    let mut from = module.to_vec();
    let mut rest = path;
    match rest.first().map(String::as_str) {
        Some("crate") => (from, rest) = (Vec::new(), &rest[1..]),
        Some("self") => rest = &rest[1..],
        Some("super") => {}
        Some(child) if known.contains(&[module, &[child.to_owned()]].concat()) => {}
        _ => return None,
    }
    while rest.first().is_some_and(|segment| segment == "super") {
        from.pop();
        rest = &rest[1..];
    }
    Some([&from, rest].concat())
}

/// The file that a path from the crate's root comes from, through at most so many re-exports.
fn origin(modules: &BTreeMap<Vec<String>, Module>, path: &[String], depth: u32) -> Option<String> {
    let length = (0..=path.len())
        .rev()
        .find(|&length| modules.contains_key(&path[..length]))?;
    let module = &modules[&path[..length]];
    let named = path.get(length).and_then(|name| module.names.get(name));
    match named.filter(|_| depth > 0) {
        Some(whole) => origin(modules, &[whole, &path[length + 1..]].concat(), depth - 1),
        None => Some(module.file.clone()),
    }
}

/// The paths in a source text.
fn paths(text: &str) -> Vec<Path> {
    let tokens = tokens(text);
    let token = |at: usize| tokens.get(at).map_or("", String::as_str);
    let (mut paths, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        let before = (0..at).rev().map(token);
        if token(at) == "use" {
            let public = before.take(5).any(|word| word == "pub") && ["pub", ")"].contains(&token(at.wrapping_sub(1)));
            at = tree(&tokens, at + 1, &[], &mut paths, (true, public));
        } else if token(at + 1) == "::" && token(at.wrapping_sub(1)) != "::" && is_name(token(at)) {
            at = tree(&tokens, at, &[], &mut paths, (false, false));
        } else {
            at += 1;
        }
    }
    paths
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Reads a tree of paths that begins with `prefix`; where it ends.
fn tree(tokens: &[String], mut at: usize, prefix: &[String], paths: &mut Vec<Path>, kind: (bool, bool)) -> usize {
    let (used, public) = kind;
    let token = |at: usize| tokens.get(at).map_or("", String::as_str);
    let mut segments = prefix.to_vec();
    loop {
        match token(at) {
            "{" => {
                at += 1;
                while !["}", ""].contains(&token(at)) {
                    at = tree(tokens, at, &segments, paths, kind);
                    at += usize::from(token(at) == ",");
                }
                return at + 1;
            }
            // `a::{self, b}` is `a` and `a::b`.
            "self" if !segments.is_empty() => {}
            name => segments.push(name.to_owned()),
        }
        at += 1;
        let goes_on = token(at) == "::" && (is_name(token(at + 1)) || (used && ["{", "*"].contains(&token(at + 1))));
        if !goes_on {
            break;
        }
        at += 1;
    }
    let mut alias = segments.last().cloned().unwrap_or_default();
    if used && token(at) == "as" {
        alias = token(at + 1).to_owned();
        at += 2;
    }
    paths.push(Path {
        segments,
        alias,
        used,
        public,
    });
    at
}

/// The names and signs of a source text without comments, texts and tests.
fn tokens(text: &str) -> Vec<String> {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let (mut tokens, mut rest) = (Vec::new(), text);
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            raw.find("\"#").map_or(rest.len(), |end| end + 5)
        } else if first == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            end.map_or(rest.len(), |end| end + 2)
        } else if ["'\"'", "'{'", "'}'"].iter().any(|literal| rest.starts_with(literal)) {
            3
        } else if let Some(escaped) = rest.strip_prefix("'\\") {
            escaped.find('\'').map_or(rest.len(), |end| end + 3)
        } else if is_name(rest) {
            let length = rest
                .find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            tokens.push(rest[..length].to_owned());
            length
        } else {
            let length = if rest.starts_with("::") { 2 } else { first.len_utf8() };
            if !first.is_whitespace() {
                tokens.push(rest[..length].to_owned());
            }
            length
        };
        rest = &rest[length..];
    }
    tokens
}
