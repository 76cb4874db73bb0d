//! `cargo xtask`: what a person does with the whole workspace.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod audit;
mod bench;
mod checks;
mod fuzz;
mod serve;
mod third_party;
mod tools;
mod web;

use anyhow::{Context, Result};
use clap::Parser;
use std::{
    env, fs,
    path::{self, Path, PathBuf},
    process::{Command, ExitCode},
};

/// Tasks of the DeepSfT workspace
#[derive(Parser)]
#[command(bin_name = "cargo xtask", infer_long_args = false)]
enum Task {
    /// Builds the browser package, serves the demo page on 127.0.0.1 and opens it
    Demo {
        /// Serve it to the other devices of the network too, over https with a certificate made on the spot, and print its address
        /// and a code that a phone can read; everybody in the network can then open it
        #[arg(long)]
        lan: bool,
        /// The port to listen on [default: the first free one from 8080; with --lan that of the other devices, from 8443]
        #[arg(long)]
        port: Option<u16>,
        /// Do not start a browser
        #[arg(long)]
        no_open: bool,
        #[command(flatten)]
        build: Build,
    },
    /// Runs every check: formatting, lints, tests of all crates, fuzzing; beside them the browser build and its size, the types of the
    /// JavaScript, the tests in Chromium, on Linux in Firefox and WebKit too
    ///
    /// Installs what is missing where it can, and says what to install where it cannot.
    Test,
    /// The same with every dependency locked, as the continuous integration runs it
    Ci,
    /// The tests of all crates once more, with assertions and checks of arithmetic in our own crates; the crates of others stay as
    /// they are built
    Assertions,
    /// Checks the packages of others that we use: advisories, licences, where they come from (cargo-deny with .cargo/deny.toml, and
    /// npm audit); installs cargo-deny below the target folder where it is missing
    Audit {
        /// Leave out advisories, which come from the internet
        #[arg(long)]
        offline: bool,
    },
    /// Tests the page in Chromium, Firefox and WebKit, which it installs where it can, and leaves a table in
    /// www/tests/screenshots/engines.md (Linux only)
    Engines {
        #[command(flatten)]
        build: Build,
    },
    /// Has the demo page follow the poster for long, on the CPU and by WebGPU, while its camera, tab and GPU are taken away and given
    /// back; fails when memory has grown (more than an hour)
    Soak {
        /// Frames that are followed on each device, 1000 or more [default: 10000]
        #[arg(long)]
        frames: Option<String>,
        /// Some of cpu,webgpu,cycles
        #[arg(long)]
        only: Option<String>,
        /// Where samples and curves go [default: soak in the target folder]
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        build: Build,
    },
    /// Feeds the readers of all formats with inputs that mutate (libFuzzer); fails when one panics, or takes more than 1 GB or 30 s
    ///
    /// It may be stopped: inputs that reached something new stay in fuzz in the target folder, and the next run begins with them.
    /// So does an input that failed, which is run first until the bug is mended. Linux only; needs a C++ compiler.
    Fuzz(fuzz::Options),
    /// Builds the browser package into www/pkg as wasm-pack.toml says, and holds it to its size budget
    Web,
    /// Writes the demo page, with the package, the models and the documentation, into a folder that any web server can serve, at any
    /// path; a folder that holds anything else is not replaced
    Site {
        /// The folder [default: site in the target folder]
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        build: Build,
    },
    /// Writes the licences of the crates that a package of the workspace is compiled from
    Notices { package: String, file: PathBuf },
    /// Measures synthesis, training and inference, natively and in the browser, beside ONNX Runtime with the same weights, the demo
    /// page without a GPU, and the sizes of the downloads; let nothing else run meanwhile
    Bench(bench::Options),
}

#[derive(clap::Args)]
struct Build {
    /// Take what was built last
    #[arg(long)]
    no_build: bool,
}

fn main() -> ExitCode {
    match run(Task::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> Result<()> {
    let root = workspace_root()?;
    let below_target = |out: Option<PathBuf>, name: &str| match out {
        Some(out) => path::absolute(out).context("finding the folder"),
        None => Ok(tools::target_folder(&root)?.join(name)),
    };
    match task {
        Task::Demo {
            lan,
            port,
            no_open,
            build,
        } => {
            if !build.no_build {
                web::build(&root)?;
            }
            tools::ensure_node_packages(&root)?;
            serve::demo(&root, port, lan, !no_open)
        }
        Task::Test => checks::run(&root, false),
        Task::Ci => checks::run(&root, true),
        Task::Assertions => checks::assertions(&root),
        Task::Audit { offline } => audit::run(&root, offline),
        Task::Engines { build } => checks::engines(&root, !build.no_build),
        Task::Soak {
            frames,
            only,
            out,
            build,
        } => {
            let options = [("--frames", frames), ("--only", only)];
            checks::soak(&root, !build.no_build, &below_target(out, "soak")?, &options)
        }
        Task::Fuzz(options) => fuzz::run(&root, &options),
        Task::Web => web::build(&root),
        Task::Site { out, build } => {
            if !build.no_build {
                web::build(&root)?;
            }
            let out = below_target(out, "site")?;
            tools::run(Command::new("node").arg(root.join("www/site.mjs")).arg(out))
        }
        Task::Notices { package, file } => {
            let text = third_party::notices(&root, &package, None)?;
            fs::write(&file, text).with_context(|| format!("writing {}", file.display()))
        }
        Task::Bench(options) => bench::run(&root, &options),
    }
}

/// The folder of the workspace's Cargo.toml: `cargo run` says where this package lies.
fn workspace_root() -> Result<PathBuf> {
    let package = env::var_os("CARGO_MANIFEST_DIR").context("run it as `cargo xtask`")?;
    let root = Path::new(&package).ancestors().nth(2);
    Ok(root.context("it lies in no workspace")?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn tasks_and_their_options_are_read_and_unfit_ones_are_refused() {
        Task::command().debug_assert();
        let parse = |line: &str| Task::try_parse_from(["xtask"].into_iter().chain(line.split_whitespace()));
        for line in [
            "test",
            "demo --lan --port 9000 --no-open --no-build",
            "soak --frames 1000 --only cpu,webgpu --out here --no-build",
            "site --out site",
            "notices deepsft-cli THIRD-PARTY.txt",
            "fuzz --target obj --input crash",
            "bench --model m --runs 5 --no-browser --no-onnxruntime",
        ] {
            assert!(parse(line).is_ok(), "{line}");
        }
        for line in [
            "",
            "tests",
            "test --fast",
            "demo --port many",
            "fuzz --input crash",
            "fuzz --seconds 0",
            "bench --runs 0",
            "soak --fast",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
