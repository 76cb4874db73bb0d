//! ONNX Runtime, natively (a Python package) and for browsers (an npm package): installed below the target folder,
//! in the versions that `crates/xtask/bench` pins.

use crate::tools;
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// Names under which Python is installed.
const PYTHON_NAMES: [&str; 2] = ["python3", "python"];

/// The pinned versions: of Python's packages, and of npm's.
pub const REQUIREMENTS: &str = "requirements.txt";
const PACKAGE: &str = "package.json";

/// The installed programs.
pub struct Rivals {
    /// Python of the virtual environment.
    python: PathBuf,
    /// The folder of our scripts.
    scripts: PathBuf,
    /// The folder of onnxruntime-web's files, if asked for.
    web: Option<PathBuf>,
    /// The network as an ONNX graph, once written.
    network: PathBuf,
}

/// The folder of the scripts and pinned versions.
pub fn scripts(root: &Path) -> PathBuf {
    root.join("crates/xtask/bench")
}

impl Rivals {
    /// Installs into `folder` what is not there yet.
    ///
    /// # Errors
    /// When Python or a package cannot be had; the message says how to do without.
    pub fn install(root: &Path, folder: &Path, with_browser: bool) -> Result<Self> {
        let scripts = scripts(root);
        let without = "ONNX Runtime cannot be installed; `cargo xtask bench --no-onnxruntime` measures without it";
        let python = install_python(&scripts, REQUIREMENTS, &folder.join("python")).context(without)?;
        let web = if with_browser {
            Some(install_web(&scripts, &folder.join("npm")).context(without)?)
        } else {
            None
        };
        let network = folder.join("network.onnx");
        Ok(Self {
            python,
            scripts,
            web,
            network,
        })
    }

    /// The folder of onnxruntime-web's files.
    pub fn web(&self) -> Option<&Path> {
        self.web.as_deref()
    }

    /// The file of the network as an ONNX graph.
    pub fn network(&self) -> &Path {
        &self.network
    }

    /// Writes the ONNX graph of an exported network, or of its main block alone, to `graph` and gives back how well ONNX Runtime
    /// agrees with us on it.
    ///
    /// # Errors
    /// When it does not agree.
    pub fn write_network(&self, exported: &Path, graph: &Path, main_only: bool) -> Result<Value> {
        let mut command = self.script("write_network.py");
        command.arg(exported).arg(graph).args(main_only.then_some("--main"));
        let printed = printed_by(&mut command).context("ONNX Runtime and DeepSfT do not agree")?;
        serde_json::from_str(&printed).context("reading what write_network.py printed")
    }

    /// Tells a command of `deepsft-lab` to let ONNX Runtime take turns with it, with the graph `graph`.
    pub fn compete(&self, bench: &mut Command, agreement: &Value, exported: &Path, graph: &Path) {
        let version = agreement["onnxruntime"].as_str().unwrap_or_default();
        let turns = self.script("onnxruntime_turns.py");
        bench.args(["--rival", &format!("ONNX Runtime {version}"), "--"]);
        bench.arg(turns.get_program()).args(turns.get_args());
        bench.arg(exported).arg(graph);
    }

    /// One of our Python scripts; `-B` leaves no compiled files among the sources.
    fn script(&self, name: &str) -> Command {
        let mut command = Command::new(&self.python);
        command.arg("-B").arg(self.scripts.join(name));
        command
    }
}

/// A virtual environment in `folder` with the packages that the file `requirements` pins; its Python.
///
/// # Errors
/// When there is no Python or a package cannot be had.
pub fn install_python(scripts: &Path, requirements: &str, folder: &Path) -> Result<PathBuf> {
    let wanted = scripts.join(requirements);
    let python = folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    });
    if is_installed(&wanted, folder) {
        return Ok(python);
    }
    let Some(system) = PYTHON_NAMES.into_iter().find_map(tools::on_path) else {
        bail!(
            "there is no Python; install version 3.11 or newer with venv and pip (Debian: apt-get install python3-venv)"
        );
    };
    empty(folder)?;
    tools::run(Command::new(system).args(["-m", "venv"]).arg(folder))?;
    let mut install = Command::new(&python);
    install.args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "--requirement",
    ]);
    tools::run(install.arg(&wanted))?;
    mark_installed(&wanted, folder)?;
    Ok(python)
}

/// The packages of `package.json`; the folder of onnxruntime-web's files.
fn install_web(scripts: &Path, folder: &Path) -> Result<PathBuf> {
    let wanted = scripts.join(PACKAGE);
    if !is_installed(&wanted, &folder.join("node_modules")) {
        empty(folder)?;
        fs::copy(&wanted, folder.join(PACKAGE)).with_context(|| format!("copying {}", wanted.display()))?;
        let mut install = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
        install.args([
            "install",
            "--ignore-scripts",
            "--no-package-lock",
            "--no-fund",
            "--no-audit",
        ]);
        tools::run(install.current_dir(folder))?;
        mark_installed(&wanted, &folder.join("node_modules"))?;
    }
    Ok(folder.join("node_modules/onnxruntime-web/dist"))
}

/// Whether the last complete installation in `folder` was of the versions in the file `wanted`.
fn is_installed(wanted: &Path, folder: &Path) -> bool {
    let (wanted, installed) = (fs::read(wanted), fs::read(folder.join("installed")));
    matches!((wanted, installed), (Ok(wanted), Ok(installed)) if wanted == installed)
}

fn mark_installed(wanted: &Path, folder: &Path) -> Result<()> {
    let mark = folder.join("installed");
    fs::copy(wanted, &mark).with_context(|| format!("writing {}", mark.display()))?;
    Ok(())
}

/// Makes an empty folder of `folder`.
fn empty(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("emptying {}", folder.display()))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
}

/// Runs a command and gives back what it printed; what it complains about is shown as it comes.
///
/// # Errors
/// When it cannot be started or fails.
pub fn printed_by(command: &mut Command) -> Result<String> {
    tools::announce(command);
    let output = command.stderr(Stdio::inherit()).output().context("starting it")?;
    ensure!(output.status.success(), "it failed ({})", output.status);
    String::from_utf8(output.stdout).context("reading what it printed")
}

/// The version that a file of requirements pins a package to.
///
/// # Errors
/// When it pins none.
#[cfg(test)]
pub fn pinned_python(root: &Path, requirements: &str, package: &str) -> Result<String> {
    let text = fs::read_to_string(scripts(root).join(requirements))?;
    let mut pins = text.lines().filter_map(|line| line.split_once("=="));
    let pin = pins.find(|(name, _)| *name == package);
    pin.map(|(_, version)| version.to_owned())
        .with_context(|| format!("no {package} in {requirements}"))
}

/// The version that `package.json` pins a package to.
///
/// # Errors
/// When it pins none.
#[cfg(test)]
pub fn pinned_npm(root: &Path, package: &str) -> Result<String> {
    let json: Value = serde_json::from_str(&fs::read_to_string(scripts(root).join(PACKAGE))?)?;
    let version = json["dependencies"][package].as_str();
    version
        .map(str::to_owned)
        .with_context(|| format!("no {package} in {PACKAGE}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_installation_counts_only_when_it_was_finished_with_the_same_versions() {
        let folder = tempfile::tempdir().unwrap();
        let wanted = folder.path().join("wanted");
        let installed = folder.path().join("packages");
        fs::write(&wanted, "a==1\n").unwrap();
        empty(&installed).unwrap();
        assert!(!is_installed(&wanted, &installed));
        mark_installed(&wanted, &installed).unwrap();
        assert!(is_installed(&wanted, &installed));
        fs::write(&wanted, "a==2\n").unwrap();
        assert!(!is_installed(&wanted, &installed));
    }
}
