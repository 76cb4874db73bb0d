//! The programs the tasks need: finding them, installing what can be installed, saying what cannot.

use crate::manifest::Tools;
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::{
    env,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

/// Names under which Chromium is installed, the most specific first.
const CHROMIUM_NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Where Chrome lies on macOS, which has no program on the PATH.
const CHROMIUM_ON_MACOS: &str = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome";

/// A `cargo` command in the workspace's root.
pub fn cargo(root: &Path) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}

/// An `npm` command in `www/`.
pub fn npm(root: &Path) -> Command {
    let mut command = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
    command.current_dir(root.join("www"));
    command
}

/// Shows a command the way a person would type it, runs it, and fails when it fails.
///
/// # Errors
/// When the program is missing or ends with another status than 0.
pub fn run(command: &mut Command) -> Result<()> {
    announce(command);
    let name = program(command);
    let mut child = command.spawn().with_context(|| format!("starting {name}"))?;
    finish(&mut child, &name)
}

/// Waits for a program.
///
/// # Errors
/// When it ends with another status than 0.
pub fn finish(child: &mut Child, name: &str) -> Result<()> {
    let status = child.wait().with_context(|| format!("waiting for {name}"))?;
    ensure!(status.success(), "{name} failed ({status})");
    Ok(())
}

/// Prints a command the way a person would type it.
pub fn announce(command: &Command) {
    let words = std::iter::once(program(command)).chain(command.get_args().map(|a| a.to_string_lossy().into_owned()));
    eprintln!("$ {}", words.collect::<Vec<_>>().join(" "));
}

/// The name of a command's program without its folder.
fn program(command: &Command) -> String {
    Path::new(command.get_program())
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// What a command prints, trimmed; `None` when it cannot be started or fails.
pub fn output(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// What cargo knows of the crates of this workspace.
fn metadata(root: &Path) -> Result<Value> {
    let metadata = output(cargo(root).args(["metadata", "--no-deps", "--format-version", "1"]));
    let metadata = metadata.context("cargo metadata failed in this workspace")?;
    serde_json::from_str(&metadata).context("reading what cargo metadata printed")
}

/// Cargo's target folder, wherever the configuration or the environment puts it.
///
/// # Errors
/// When `cargo metadata` fails.
pub fn target_folder(root: &Path) -> Result<PathBuf> {
    metadata(root)?["target_directory"]
        .as_str()
        .map(PathBuf::from)
        .context("cargo metadata names no target folder")
}

/// The names of the crates of this workspace.
///
/// # Errors
/// When `cargo metadata` fails.
pub fn workspace_crates(root: &Path) -> Result<Vec<String>> {
    let metadata = metadata(root)?;
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let names: Vec<String> = packages
        .filter_map(|package| Some(package["name"].as_str()?.to_owned()))
        .collect();
    ensure!(!names.is_empty(), "cargo metadata names no crates");
    Ok(names)
}

/// Sees to it that the pinned toolchain can compile for `target`.
///
/// # Errors
/// When it cannot, and rustup is missing or fails.
pub fn ensure_rust_target(root: &Path, target: &str) -> Result<()> {
    let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]).current_dir(root));
    let sysroot = PathBuf::from(sysroot.context("rustc does not start; install Rust with rustup (https://rustup.rs)")?);
    if sysroot.join("lib/rustlib").join(target).join("lib").is_dir() {
        return Ok(());
    }
    let rustup = run(Command::new("rustup").args(["target", "add", target]).current_dir(root));
    rustup.with_context(|| format!("this Rust cannot compile for {target}, and rustup could not add that target"))
}

/// Sees to it that Node.js is there, new enough, and that the packages of `www/package-lock.json` are
/// installed.
///
/// # Errors
/// When Node.js is missing or too old, or `npm ci` fails.
pub fn ensure_node_packages(root: &Path, tools: &Tools) -> Result<()> {
    let needed = tools.node_at_least;
    if on_path("node").is_none() || output(npm(root).arg("--version")).is_none() {
        install_with_apt(&["nodejs", "npm"]);
    }
    let version = output(Command::new("node").arg("--version"));
    let version = version.with_context(|| {
        format!("Node.js is missing; install version {needed} or newer with npm (https://nodejs.org, or your system's packages)")
    })?;
    let major = version
        .trim_start_matches('v')
        .split('.')
        .next()
        .and_then(|major| major.parse::<u32>().ok());
    ensure!(
        major.is_some_and(|major| major >= needed),
        "Node.js is {version}, but version {needed} or newer is needed"
    );
    let modified = |file: &str| fs::metadata(root.join("www").join(file)).and_then(|file| file.modified());
    let installed = modified("node_modules/.package-lock.json");
    let wanted = modified("package-lock.json").context("reading www/package-lock.json")?;
    if installed.is_ok_and(|installed| installed >= wanted) {
        return Ok(());
    }
    run(npm(root).args(["ci", "--no-fund", "--no-audit"]))
}

/// The Chromium the browser tests run: `DEEPSFT_CHROMIUM`, or one that is installed, or a new
/// installation from Debian's packages.
///
/// # Errors
/// When there is none; the message says how to get one.
pub fn chromium() -> Result<PathBuf> {
    if let Some(program) = env::var_os("DEEPSFT_CHROMIUM") {
        let program = PathBuf::from(program);
        ensure!(
            program.is_file(),
            "DEEPSFT_CHROMIUM is {}, which is no file",
            program.display()
        );
        return Ok(program);
    }
    let find = || {
        let on_macos = Path::new(CHROMIUM_ON_MACOS);
        CHROMIUM_NAMES
            .into_iter()
            .find_map(on_path)
            .or_else(|| on_macos.is_file().then(|| on_macos.to_owned()))
    };
    if let Some(program) = find() {
        return Ok(program);
    }
    install_with_apt(&["chromium"]);
    match find() {
        Some(program) => Ok(program),
        None => bail!(
            "no Chromium: the tests run in a real browser. Install it (Debian: apt-get install chromium), or name one in \
             DEEPSFT_CHROMIUM"
        ),
    }
}

/// A program that the tests in Firefox and WebKit run.
struct EngineProgram {
    /// The variable that tells the tests where it is, or that names it beforehand.
    variable: &'static str,
    names: &'static [&'static str],
    debian_packages: &'static [&'static str],
}

/// Firefox, WebKitGTK with the plugins that play the clip, and a screen that nobody sees.
const ENGINE_PROGRAMS: [EngineProgram; 3] = [
    EngineProgram {
        variable: "DEEPSFT_FIREFOX",
        names: &["firefox-esr", "firefox"],
        debian_packages: &["firefox-esr"],
    },
    EngineProgram {
        variable: "DEEPSFT_WEBKIT_DRIVER",
        names: &["WebKitWebDriver"],
        debian_packages: &["webkit2gtk-driver", "gstreamer1.0-plugins-good"],
    },
    EngineProgram {
        variable: "DEEPSFT_XVFB",
        names: &["Xvfb"],
        debian_packages: &["xvfb"],
    },
];

/// The programs that the tests in Firefox and WebKit run, by the variables that tell the tests where they are: as these name
/// them, or installed, or newly installed from Debian's packages.
///
/// # Errors
/// When one is missing; the message says how to get it.
pub fn engine_programs() -> Result<Vec<(&'static str, PathBuf)>> {
    let find = |program: &EngineProgram| match env::var_os(program.variable) {
        Some(named) => Some(PathBuf::from(named)).filter(|named| named.is_file()),
        None => program.names.iter().copied().find_map(on_path),
    };
    let is_missing = |program: &&EngineProgram| env::var_os(program.variable).is_none() && find(program).is_none();
    let missing = ENGINE_PROGRAMS.iter().filter(is_missing);
    let packages: Vec<&str> = missing.flat_map(|program| program.debian_packages).copied().collect();
    if !packages.is_empty() {
        install_with_apt(&packages);
    }
    let found = |program: &EngineProgram| {
        let path = find(program).with_context(|| {
            format!(
                "no {}: the page is tested in Firefox and WebKit too. Install it (Debian: apt-get install {}), or name it in {}",
                program.names[0],
                program.debian_packages.join(" "),
                program.variable
            )
        })?;
        Ok((program.variable, path))
    };
    ENGINE_PROGRAMS.iter().map(found).collect()
}

/// Sees to it that there is a C++ compiler: libFuzzer is compiled by it.
///
/// # Errors
/// When there is none and Debian's cannot be installed.
pub fn ensure_cpp_compiler() -> Result<()> {
    let is_there = || {
        let names = ["c++", "g++", "clang++"];
        env::var_os("CXX").is_some() || names.iter().any(|name| on_path(name).is_some())
    };
    if !is_there() {
        install_with_apt(&["g++"]);
    }
    ensure!(
        is_there(),
        "libFuzzer needs a C++ compiler (on Debian and Ubuntu `apt install g++`)"
    );
    Ok(())
}

/// The first program called `name` on the PATH.
pub fn on_path(name: &str) -> Option<PathBuf> {
    let file = format!("{name}{}", env::consts::EXE_SUFFIX);
    env::split_paths(&env::var_os("PATH")?)
        .map(|folder| folder.join(&file))
        .find(|program| program.is_file())
}

/// Installs Debian packages where that is possible without a question: as root, or with a sudo that
/// asks for no password. A failure is printed by apt itself; the caller looks again for the program.
fn install_with_apt(packages: &[&str]) {
    if on_path("apt-get").is_none() {
        return;
    }
    let is_root = output(Command::new("id").arg("-u")).as_deref() == Some("0");
    let has_sudo = || output(Command::new("sudo").args(["-n", "true"])).is_some();
    let prefix: &[&str] = match is_root {
        true => &["apt-get"],
        false if has_sudo() => &["sudo", "-n", "apt-get"],
        false => return,
    };
    for arguments in [
        &["update", "--quiet"][..],
        &[&["install", "--yes", "--no-install-recommends"], packages].concat(),
    ] {
        let words: Vec<&str> = prefix.iter().chain(arguments).copied().collect();
        if let Err(error) = run(Command::new(words[0])
            .args(&words[1..])
            .env("DEBIAN_FRONTEND", "noninteractive"))
        {
            eprintln!("{error:#}");
        }
    }
}

/// Asks the desktop to open an address. Without a desktop nothing happens: the address was printed.
pub fn open_in_browser(address: &str) {
    let (program, arguments): (&str, &[&str]) = match env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let arguments = arguments.iter().map(OsStr::new).chain([OsStr::new(address)]);
    let started = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if started.is_err() {
        println!("No browser could be started from here: open the address by hand.");
    }
}
