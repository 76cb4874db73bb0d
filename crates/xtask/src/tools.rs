//! The programs the tasks need: finding them, installing what can be installed, saying what cannot.

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::{
    env,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

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
pub fn run(command: &mut Command) -> Result<()> {
    announce(command);
    let name = program(command);
    let mut child = command.spawn().with_context(|| format!("starting {name}"))?;
    finish(&mut child, &name)
}

/// Waits for a program.
pub fn finish(child: &mut Child, name: &str) -> Result<()> {
    let status = child.wait().with_context(|| format!("waiting for {name}"))?;
    ensure!(status.success(), "{name} failed ({status})");
    Ok(())
}

/// Makes an empty folder of `folder`.
pub fn empty(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("emptying {}", folder.display()))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
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

/// What `cargo metadata` with these options more knows of this workspace.
pub fn metadata(root: &Path, options: &[&str]) -> Result<Value> {
    let metadata = output(cargo(root).args(["metadata", "--format-version", "1"]).args(options));
    let metadata = metadata.context("cargo metadata failed in this workspace")?;
    serde_json::from_str(&metadata).context("reading what cargo metadata printed")
}

/// Cargo's target folder, wherever the configuration or the environment puts it.
pub fn target_folder(root: &Path) -> Result<PathBuf> {
    metadata(root, &["--no-deps"])?["target_directory"]
        .as_str()
        .map(PathBuf::from)
        .context("cargo metadata names no target folder")
}

/// Sees to it that Node.js is there, as new as `www/package.json` asks for, and that the packages of `www/package-lock.json` are
/// installed.
pub fn ensure_node_packages(root: &Path) -> Result<()> {
    let package: Value = json(&root.join("www/package.json"))?;
    let needed = package["engines"]["node"]
        .as_str()
        .context("www/package.json asks for no Node.js")?;
    if on_path("node").is_none() || output(npm(root).arg("--version")).is_none() {
        install_with_apt(&["nodejs", "npm"]);
    }
    let version = output(Command::new("node").arg("--version"));
    let version = version.with_context(|| {
        format!("Node.js is missing; install version {needed} with npm (https://nodejs.org, or your system's packages)")
    })?;
    ensure!(
        major(&version) >= major(needed),
        "Node.js is {version}, but {needed} is needed"
    );
    let modified = |file: &str| fs::metadata(root.join("www").join(file)).and_then(|file| file.modified());
    let installed = modified("node_modules/.package-lock.json");
    let wanted = modified("package-lock.json").context("reading www/package-lock.json")?;
    if installed.is_ok_and(|installed| installed >= wanted) {
        return Ok(());
    }
    run(npm(root).args(["ci", "--no-fund", "--no-audit"]))
}

/// Sees to it that ffmpeg is on the PATH, where the command line looks for it.
///
/// # Errors
/// When it cannot be installed; the message says what to do.
pub fn ensure_ffmpeg() -> Result<()> {
    if on_path("ffmpeg").is_none() {
        install_with_apt(&["ffmpeg"]);
    }
    on_path("ffmpeg").context("no ffmpeg, which the checks need. Install it (Debian: apt-get install ffmpeg)")?;
    Ok(())
}

/// The first number in a version such as `v20.1.0` or `>=20`.
fn major(version: &str) -> Option<u32> {
    let digits = version.trim_start_matches(|c: char| !c.is_ascii_digit());
    digits.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// A file of JSON.
pub fn json(file: &Path) -> Result<Value> {
    let reading = || format!("reading {}", file.display());
    serde_json::from_slice(&fs::read(file).with_context(reading)?).with_context(reading)
}

/// A program that the checks run.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// The variable that tells the tests where it is, or that names it beforehand.
    pub variable: &'static str,
    /// Names under which it is installed, the most specific first; on macOS, which has none on the PATH, the whole path.
    names: &'static [&'static str],
    debian_packages: &'static [&'static str],
}

pub const CHROMIUM: Program = Program {
    variable: "DEEPSFT_CHROMIUM",
    names: &[
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    ],
    debian_packages: &["chromium"],
};

/// Firefox, WebKitGTK with the plugins that play the clip, and a screen that nobody sees.
pub const OTHER_ENGINES: [Program; 3] = [
    Program {
        variable: "DEEPSFT_FIREFOX",
        names: &["firefox-esr", "firefox"],
        debian_packages: &["firefox-esr"],
    },
    Program {
        variable: "DEEPSFT_WEBKIT_DRIVER",
        names: &["WebKitWebDriver"],
        debian_packages: &["webkit2gtk-driver", "gstreamer1.0-plugins-good"],
    },
    Program {
        variable: "DEEPSFT_XVFB",
        names: &["Xvfb"],
        debian_packages: &["xvfb"],
    },
];

/// The C++ compiler, by which libFuzzer is compiled.
pub const CPP_COMPILER: Program = Program {
    variable: "CXX",
    names: &["c++", "g++", "clang++"],
    debian_packages: &["g++"],
};

impl Program {
    /// Where it is: as its variable names it, or installed, or newly installed from Debian's packages.
    ///
    /// # Errors
    /// When it is missing; the message says how to get it.
    pub fn find(&self) -> Result<PathBuf> {
        let find = || match env::var_os(self.variable) {
            Some(named) => on_path(&named),
            None => self.names.iter().find_map(on_path),
        };
        if find().is_none() && env::var_os(self.variable).is_none() {
            install_with_apt(self.debian_packages);
        }
        find().with_context(|| {
            format!(
                "no {}, which the checks need. Install it (Debian: apt-get install {}), or name it in {}",
                self.names[0],
                self.debian_packages.join(" "),
                self.variable
            )
        })
    }
}

/// The first program called `name` on the PATH; a whole path is itself.
pub fn on_path(name: impl AsRef<OsStr>) -> Option<PathBuf> {
    let bare = name.as_ref().to_owned();
    let mut with_ending = bare.clone();
    with_ending.push(env::consts::EXE_SUFFIX);
    env::split_paths(&env::var_os("PATH")?)
        .flat_map(|folder| [folder.join(&with_ending), folder.join(&bare)])
        .find(|program| program.is_file())
}

/// Installs Debian packages where that is possible without a question: as root, or with a sudo that
/// asks for no password. A failure is printed by apt itself; the caller looks again for the program.
fn install_with_apt(packages: &[&str]) {
    if on_path("apt-get").is_none() {
        return;
    }
    let is_root = output(Command::new("id").arg("-u")).as_deref() == Some("0");
    if !is_root && output(Command::new("sudo").args(["-n", "true"])).is_none() {
        return;
    }
    let apt = |arguments: &[&str]| {
        let mut command = Command::new(if is_root { "apt-get" } else { "sudo" });
        command.args((!is_root).then_some(["-n", "apt-get"]).into_iter().flatten());
        let done = run(command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive"));
        done.unwrap_or_else(|error| eprintln!("{error:#}"));
    };
    apt(&["update", "--quiet"]);
    apt(&[&["install", "--yes", "--no-install-recommends"], packages].concat());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_by_their_first_number() {
        assert_eq!(major("v20.11.1"), Some(20));
        assert_eq!(major(">=20"), Some(20));
        assert!(major("v9.0.0") < major(">=20") && major("nonsense") < major(">=20"));
    }
}
