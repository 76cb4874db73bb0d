//! ONNX Runtime, natively (a Python package) and for browsers (an npm package): installed below the target folder,
//! in the versions that `crates/xtask/bench` pins.

use crate::tools;
use anyhow::{Context, Result};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The pinned versions: of Python's packages, and of npm's.
const REQUIREMENTS: &str = "requirements.txt";
const PACKAGE: &str = "package.json";

/// The installed programs.
pub struct Rivals {
    /// Python of the virtual environment.
    python: PathBuf,
    /// The folder of our scripts.
    scripts: PathBuf,
    /// The folder of onnxruntime-web's files, if asked for.
    pub web: Option<PathBuf>,
}

impl Rivals {
    /// Installs into `folder` what is not there yet.
    ///
    /// # Errors
    /// When Python or a package cannot be had; the message says how to do without.
    pub fn install(root: &Path, folder: &Path, with_browser: bool) -> Result<Self> {
        let scripts = root.join("crates/xtask/bench");
        let without = "ONNX Runtime cannot be installed; `cargo xtask bench --no-onnxruntime` measures without it";
        let python = install_python(&scripts.join(REQUIREMENTS), &folder.join("python")).context(without)?;
        let web = with_browser
            .then(|| install_web(&scripts.join(PACKAGE), &folder.join("npm")))
            .transpose()
            .context(without)?;
        Ok(Self { python, scripts, web })
    }

    /// One of our Python scripts; `-B` leaves no compiled files among the sources.
    pub fn script(&self, name: &str) -> Command {
        let mut command = Command::new(&self.python);
        command.arg("-B").arg(self.scripts.join(name));
        command
    }
}

/// A virtual environment in `folder` with the packages that the file `wanted` pins; its Python.
fn install_python(wanted: &Path, folder: &Path) -> Result<PathBuf> {
    let python = folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    });
    once(wanted, folder, || {
        let system = ["python3", "python"].iter().find_map(tools::on_path);
        let system = system
            .context("there is no Python; install version 3.11 or newer with venv and pip (Debian: apt-get install python3-venv)")?;
        tools::run(Command::new(system).args(["-m", "venv"]).arg(folder))?;
        let mut install = Command::new(&python);
        install.args(["-m", "pip", "install", "--quiet", "--requirement"]);
        tools::run(install.arg(wanted))
    })?;
    Ok(python)
}

/// The npm packages of the file `wanted`; the folder of onnxruntime-web's files.
fn install_web(wanted: &Path, folder: &Path) -> Result<PathBuf> {
    once(wanted, folder, || {
        fs::copy(wanted, folder.join(PACKAGE)).with_context(|| format!("copying {}", wanted.display()))?;
        let mut install = tools::npm(folder);
        install.args(["install", "--ignore-scripts", "--no-package-lock", "--no-audit"]);
        tools::run(install.current_dir(folder))
    })?;
    Ok(folder.join("node_modules/onnxruntime-web/dist"))
}

/// Empties `folder` and has `install` fill it, unless that has been done with the versions in the file `wanted`.
fn once(wanted: &Path, folder: &Path, install: impl FnOnce() -> Result<()>) -> Result<()> {
    let mark = folder.join("installed");
    let versions = fs::read(wanted).with_context(|| format!("reading {}", wanted.display()))?;
    if fs::read(&mark).is_ok_and(|installed| installed == versions) {
        return Ok(());
    }
    tools::empty(folder)?;
    install()?;
    fs::write(&mark, versions).with_context(|| format!("writing {}", mark.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::bail;
    use serde_json::Value;

    #[test]
    fn an_installation_counts_only_when_it_was_finished_with_the_same_versions() {
        let folder = tempfile::tempdir().unwrap();
        let (wanted, packages) = (folder.path().join("wanted"), folder.path().join("packages"));
        fs::write(&wanted, "a==1\n").unwrap();
        assert!(once(&wanted, &packages, || bail!("no network")).is_err());
        let installs = || {
            let mut called = false;
            once(&wanted, &packages, || {
                called = true;
                Ok(())
            })
            .unwrap();
            called
        };
        assert_eq!([installs(), installs()], [true, false]);
        fs::write(&wanted, "a==2\n").unwrap();
        assert!(installs());
    }

    #[test]
    fn both_onnx_runtimes_are_of_one_version() {
        let scripts = crate::workspace_root().unwrap().join("crates/xtask/bench");
        let python = fs::read_to_string(scripts.join(REQUIREMENTS)).unwrap();
        let npm: Value = tools::json(&scripts.join(PACKAGE)).unwrap();
        let version = npm["dependencies"]["onnxruntime-web"].as_str().unwrap();
        assert!(python.lines().any(|line| line == format!("onnxruntime=={version}")));
    }
}
