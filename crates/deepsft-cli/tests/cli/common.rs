//! What the tests of the command share: running it, and inputs for it.

use deepsft::{
    Accuracy, Architecture, CompactConfig, DeviceKind, FoundRule, ModelBundle, ModelCard, NetworkConfig, Provenance,
    encode_png, template_to_files,
};
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_network::{Network, start_device};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

/// What a run of the command left behind.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

/// Runs `deepsft` in `folder`.
pub fn deepsft<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Run {
    run(Command::new(env!("CARGO_BIN_EXE_deepsft"))
        .args(arguments)
        .current_dir(folder))
}

/// Runs `deepsft` in `folder` where other programs are found in `path` only.
pub fn deepsft_with_path<S: AsRef<OsStr>>(folder: &Path, path: &Path, arguments: &[S]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_deepsft"));
    run(command.args(arguments).current_dir(folder).env("PATH", path))
}

/// Runs `deepsft` in `folder` with a standard output whose reader has gone.
pub fn deepsft_without_reader<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Run {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_deepsft"));
    let child = command.args(arguments).current_dir(folder).stdout(writer);
    let child = child.stderr(Stdio::piped()).spawn().unwrap();
    run_of(&child.wait_with_output().unwrap())
}

/// Runs `deepsft` in `folder` where no file can be larger than so many bytes: writing more is an error, and no end of the process.
#[cfg(target_os = "linux")]
pub fn deepsft_with_small_files(folder: &Path, bytes: u64, arguments: &[&str]) -> Run {
    // A shell counts blocks of 512 bytes, or of 1024 if it is bash by another name.
    let script = "trap '' XFSZ; if [ \"$BASH_VERSION\" ]; then ulimit -f $(($0 / 1024)); else ulimit -f $(($0 / 512)); fi; \
                  exec \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", script, &bytes.to_string(), env!("CARGO_BIN_EXE_deepsft")]);
    run(command.args(arguments).current_dir(folder))
}

fn run(command: &mut Command) -> Run {
    run_of(&command.output().unwrap())
}

fn run_of(output: &Output) -> Run {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Run {
        code: output.status.code().unwrap(),
        stdout: text(&output.stdout),
        stderr: text(&output.stderr),
    }
}

impl Run {
    /// Checks that the run failed with `code` and told each of `parts`.
    pub fn fails(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, code, "{self:?}");
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }

    /// Checks that the run succeeded.
    pub fn succeeds(&self) -> &Self {
        assert_eq!(self.code, 0, "{self:?}");
        self
    }
}

/// A picture that is nowhere like itself.
pub fn art() -> Picture {
    Picture::from_fn(120, 90, |x, y| [(2 * x) as u8, (2 * y) as u8, (x * y % 251) as u8])
}

/// A template of 200 x 150 mm with that picture.
pub fn template() -> Template {
    Template::thin_shell(art(), 200.0, 150.0).unwrap()
}

/// Writes files by name into `folder`.
pub fn write_files(folder: &Path, files: &BTreeMap<String, Vec<u8>>) {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// Writes the template into the folder `name` of `folder`.
pub fn write_template(folder: &Path, name: &str) {
    write_files(&folder.join(name), &template_to_files(&template()).unwrap());
}

/// Writes a bundle of a compact network with its first, untrained weights into the folder `name` of `folder`.
pub fn write_bundle(folder: &Path, name: &str) {
    write_bundle_of(folder, name, Architecture::Compact(CompactConfig::default()));
}

/// One network is drawn at a time: tests share the device's random numbers.
static DRAWN: Mutex<()> = Mutex::new(());

/// The same of a network of any architecture. Its weights are the same every time.
pub fn write_bundle_of(folder: &Path, name: &str, architecture: Architecture) {
    let (device, _) = pollster::block_on(start_device(DeviceKind::Cpu)).unwrap();
    let _drawn = DRAWN.lock().unwrap_or_else(PoisonError::into_inner);
    device.seed(1);
    let camera = training_camera();
    let network = Network::new(&NetworkConfig::new(architecture, [200.0, 150.0], &camera), &device).fold();
    let card = ModelCard {
        name: "untrained".to_owned(),
        licence: Some("MIT OR Apache-2.0".to_owned()),
        found: FoundRule::default(),
        provenance: Provenance::default(),
        accuracy: Accuracy::default(),
    };
    let bundle = ModelBundle::new(network.folded(), template(), camera, card);
    write_files(&folder.join(name), &bundle.to_files().unwrap());
}

/// Writes a grey photograph of 640 x 360 pixels.
pub fn write_photograph(folder: &Path, name: &str) {
    let picture = Picture::from_fn(640, 360, |x, y| [((x + y) % 200) as u8; 3]);
    fs::write(folder.join(name), encode_png(&picture).unwrap()).unwrap();
}

/// The header of an `.npy` file and the bytes after it.
pub fn npy(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    assert_eq!(bytes[..8], *b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    (
        String::from_utf8(bytes[10..end].to_vec()).unwrap(),
        bytes[end..].to_vec(),
    )
}
