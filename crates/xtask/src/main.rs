//! `cargo xtask`: what a person does with the whole workspace.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod audit;
mod bench;
mod checks;
mod fuzz;
mod manifest;
mod serve;
mod third_party;
mod tools;
mod web;

use anyhow::{Context, Result, bail};
use std::{
    env, fs,
    path::{self, Path, PathBuf},
    process::{Command, ExitCode},
};

const HELP: &str = "\
Tasks of the DeepSfT workspace

    cargo xtask demo [--lan] [--port PORT] [--no-open] [--no-build]
        Builds the browser package, serves the demo page on 127.0.0.1 and opens it.
        --lan       serves it to the other devices of the network too, over https with a certificate made on the spot, and
                    prints its address and a code that a phone can read; everybody in the network can then open it
        --port      the port to listen on (default: the first free one from 8080; with --lan that of the other devices, from 8443)
        --no-open   do not start a browser
        --no-build  serve what was built last

    cargo xtask test
        Everything that can be checked, cheapest first: formatting, lints, tests of all crates, the browser
        build and its size, the types of the JavaScript, the tests in a real browser, on Linux in Firefox and WebKit too.
        Installs what is missing where it can, and says what to install where it cannot.

    cargo xtask ci
        The same with every dependency locked, as the continuous integration runs it.

    cargo xtask assertions
        The tests of all crates once more, with the assertions and the checks of arithmetic that a release leaves out, in our own
        crates alone: the crates of others stay as they are built.

    cargo xtask audit [--offline]
        Checks the packages of others that we use: advisories, licences, where they come from (cargo-deny, with
        .cargo/deny.toml, and npm audit). Installs cargo-deny below the target folder where it is missing.
        --offline   without advisories, which come from the internet

    cargo xtask engines [--no-build]
        The page in Chromium, Firefox and WebKit: camera, clip, image, own picture, errors. Ends with a table, which it
        leaves in www/tests/screenshots/engines.md. Installs the browsers where it can. Linux only.
        --no-build  take what was built last

    cargo xtask soak [--frames N] [--only PARTS] [--out DIR] [--no-build]
        Long life in Chromium: the demo page follows the poster before a camera, on the CPU and by WebGPU; its camera, its tab and its
        GPU are taken away and given back; things are started and stopped again and again. Fails when memory has grown, and leaves
        samples and curves. Takes more than an hour.
        --frames    frames that are followed on each device, 1000 or more (default: 10000)
        --only      some of cpu,webgpu,cycles
        --out       the folder (default: soak in the target folder)
        --no-build  take what was built last

    cargo xtask fuzz [--target NAME] [--seconds N | --runs N] [--jobs N] [--input FILE]
        Feeds the readers of all formats with inputs that mutate (libFuzzer), and ends with an error when one of them panics
        or takes more than 1 GB or 10 s: with the file of the first such input of each. Inputs that reached something new
        stay in fuzz in the target folder, and the next run begins with them. Linux only; needs a C++ compiler.
        --target   one of bundle, checkpoint, gltf, obj, picture, recording, shard, template, weights, y4m (default: all)
        --seconds  how long for all targets together (default: 60)
        --runs     go on until each target has had so many inputs, those of earlier runs included
        --jobs     processes at once (default: 1)
        --input    run this file alone, an input of --target

    cargo xtask web
        Builds the browser package into www/pkg as wasm-pack.toml says, and holds it to its size budget.

    cargo xtask site [--out DIR] [--no-build]
        Builds the browser package and writes the demo page, with the package, the models and the documentation, into a
        folder that any web server can serve, at any path. A folder that holds anything else is not replaced.
        --out       the folder (default: site in the target folder)
        --no-build  take what was built last

    cargo xtask notices PACKAGE FILE
        Writes the licences of the crates that a package of the workspace is compiled from.

    cargo xtask bench [--model DIR] [--json FILE] [--runs N] [--no-build] [--no-browser] [--no-onnxruntime]
        Measures synthesis, training and inference, natively and in the browser, beside ONNX Runtime with the
        same weights (installed below the target folder; needs Python), the demo page without a GPU, and the
        sizes of the downloads. Let nothing else run meanwhile.
        --model           the model bundle (default: models/poster-a4)
        --json            where the figures go (default: bench/bench.json in the target folder)
        --runs            frames for each median (default: 21)
        --no-build        measure what was built last
        --no-browser      leave the browser out
        --no-onnxruntime  leave ONNX Runtime out

    cargo xtask bench --only architectures [--json FILE] [--runs N] [--no-build]
        Measures the paper's network and R50F, untrained, beside ONNX Runtime with the same weights.

    cargo xtask bench --only completion [--json FILE] [--runs N] [--no-build] [--no-libigl]
        Measures ARAP completion on meshes of 1,500 to 40,000 faces beside libigl (installed below the target
        folder; needs Python): energy, precompute, a frame with a new visible set, a warm-started frame.
";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    if let Some((rustc, arguments)) = fuzz::instrument::called_as_rustc(&arguments) {
        return fuzz::instrument::rustc(rustc, arguments).unwrap_or_else(|error| {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        });
    }
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Vec<String>) -> Result<()> {
    let mut arguments = arguments.into_iter();
    let task = arguments.next();
    let rest: Vec<String> = arguments.collect();
    let asks_for_help = |argument: &str| ["help", "--help", "-h"].contains(&argument);
    if task.as_deref().is_none_or(asks_for_help) || rest.iter().any(|argument| asks_for_help(argument)) {
        print!("{HELP}");
        return Ok(());
    }
    let root = workspace_root()?;
    match task.as_deref().unwrap_or_default() {
        "demo" => demo(&root, &rest),
        "test" => takes_no_arguments("test", &rest).and_then(|()| checks::run(&root, checks::Mode::Developer)),
        "ci" => takes_no_arguments("ci", &rest).and_then(|()| checks::run(&root, checks::Mode::Ci)),
        "assertions" => takes_no_arguments("assertions", &rest).and_then(|()| checks::assertions(&root)),
        "audit" => audit(&root, &rest),
        "engines" => engines(&root, &rest),
        "fuzz" => fuzz::run(&root, &fuzz::Options::parse(&rest)?),
        "site" => site(&root, &rest),
        "soak" => soak(&root, &rest),
        "notices" => notices(&root, &rest),
        "web" => takes_no_arguments("web", &rest).and_then(|()| web::build(&root)),
        "bench" => bench::run(&root, &bench::Options::parse(&rest)?),
        other => bail!("there is no task {other:?}\n\n{HELP}"),
    }
}

fn takes_no_arguments(task: &str, rest: &[String]) -> Result<()> {
    match rest.first() {
        None => Ok(()),
        Some(first) => bail!("cargo xtask {task} takes no arguments, got {first:?}"),
    }
}

fn demo(root: &Path, arguments: &[String]) -> Result<()> {
    let (mut port, mut lan, mut open, mut build) = (None, false, true, true);
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--lan" => lan = true,
            "--port" => {
                let value = arguments.next().context("--port wants a number")?;
                port = Some(
                    value
                        .parse::<u16>()
                        .with_context(|| format!("--port {value}: not a port number"))?,
                );
            }
            "--no-open" => open = false,
            "--no-build" => build = false,
            other => bail!("cargo xtask demo does not know {other:?}\n\n{HELP}"),
        }
    }
    if build {
        web::build(root)?;
    }
    tools::ensure_node_packages(root, &manifest::Manifest::load(root)?.tools)?;
    let server = serve::Server::start(root, port, lan)?;
    println!("The demo is at {} (stop with Ctrl-C)", server.address);
    if open {
        tools::open_in_browser(&server.address);
    }
    server.wait()
}

fn audit(root: &Path, arguments: &[String]) -> Result<()> {
    match arguments {
        [] => audit::run(root, false),
        [only] if only == "--offline" => audit::run(root, true),
        [other, ..] => bail!("cargo xtask audit does not know {other:?}\n\n{HELP}"),
    }
}

fn engines(root: &Path, arguments: &[String]) -> Result<()> {
    match arguments {
        [] => checks::engines(root, true),
        [only] if only == "--no-build" => checks::engines(root, false),
        [other, ..] => bail!("cargo xtask engines does not know {other:?}\n\n{HELP}"),
    }
}

fn soak(root: &Path, arguments: &[String]) -> Result<()> {
    let mut out = tools::target_folder(root)?.join("soak");
    let (mut build, mut passed_on) = (true, Vec::new());
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().with_context(|| format!("{argument} wants a value"));
        match argument.as_str() {
            "--frames" | "--only" => passed_on.extend([argument.as_str(), value()?]),
            "--out" => out = path::absolute(value()?).context("finding the folder")?,
            "--no-build" => build = false,
            other => bail!("cargo xtask soak does not know {other:?}\n\n{HELP}"),
        }
    }
    checks::soak(root, build, &out, &passed_on)
}

fn site(root: &Path, arguments: &[String]) -> Result<()> {
    let (mut out, mut build) = (None, true);
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = Some(PathBuf::from(arguments.next().context("--out wants a folder")?)),
            "--no-build" => build = false,
            other => bail!("cargo xtask site does not know {other:?}\n\n{HELP}"),
        }
    }
    if build {
        web::build(root)?;
    }
    let out = match out {
        Some(out) => out,
        None => tools::target_folder(root)?.join("site"),
    };
    tools::run(Command::new("node").arg(root.join("www/site.mjs")).arg(out))
}

fn notices(root: &Path, arguments: &[String]) -> Result<()> {
    let [package, file] = arguments else {
        bail!("cargo xtask notices wants a package and a file\n\n{HELP}")
    };
    let text = third_party::notices(root, package, None)?;
    fs::write(file, text).with_context(|| format!("writing {file}"))
}

/// The folder of the workspace's Cargo.toml: where `cargo run` says this package lies, or the nearest
/// parent of the current folder that has the build manifest.
fn workspace_root() -> Result<PathBuf> {
    let start = match env::var_os("CARGO_MANIFEST_DIR") {
        Some(folder) => PathBuf::from(folder),
        None => env::current_dir().context("finding the current folder")?,
    };
    let root = start
        .ancestors()
        .find(|folder| folder.join(manifest::FILE_NAME).is_file());
    root.map(Path::to_owned)
        .with_context(|| format!("no {} in {} or above", manifest::FILE_NAME, start.display()))
}
