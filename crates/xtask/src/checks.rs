//! `cargo xtask test`: every check of the workspace, one count and a table of seconds at the end.

use crate::{fuzz, tools, web};
use anyhow::{Context, Result, bail, ensure};
use std::{
    env,
    io::{BufRead, BufReader},
    path::Path,
    process::{Command, Stdio},
    sync::{Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

/// Whether this system has WebKitGTK and a screen that nobody sees.
const LINUX: bool = cfg!(target_os = "linux");

/// How long all fuzz targets run together, s.
const FUZZING_S: u64 = 30;

/// Tests that passed and failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Count {
    passed: u64,
    failed: u64,
}

/// Runs all checks, the later ones also after a failure. What is built for the crates and for the page is built side by side. `locked`:
/// `Cargo.lock` is taken as it is or refused, and does not follow an edited Cargo.toml.
///
/// # Errors
/// When a check fails, after the closing table.
pub fn run(root: &Path, locked: bool) -> Result<()> {
    let began = Instant::now();
    let outcomes = Mutex::new(Vec::new());
    let check = |name: &'static str, body: &dyn Fn() -> Result<Count>| {
        eprintln!("\n== {name}");
        let started = Instant::now();
        let count = body().unwrap_or_else(|error| {
            eprintln!("{name}: {error:#}");
            Count { passed: 0, failed: 1 }
        });
        let outcome = (name, count, started.elapsed());
        outcomes.lock().unwrap_or_else(PoisonError::into_inner).push(outcome);
        count.failed == 0
    };
    let passed = |(): ()| Count { passed: 1, failed: 0 };
    let cargo = |arguments: &[&str]| {
        let mut command = tools::cargo(root);
        command.args(arguments).args(locked.then_some("--locked"));
        command
    };
    check("formatting", &|| {
        counted(tools::cargo(root).args(["fmt", "--all", "--check"]))
    });
    check("packages of Node", &|| tools::ensure_node_packages(root).map(passed));
    let tests = ["test", "--release", "--workspace", "--no-fail-fast"];
    let is_page_built = thread::scope(|scope| {
        // They are downloaded while others compute.
        scope.spawn(|| {
            check("browsers and ffmpeg", &|| {
                let others: &[tools::Program] = if LINUX { &tools::OTHER_ENGINES } else { &[] };
                let mut programs = others.iter().chain([&tools::CHROMIUM]);
                programs.try_for_each(|program| program.find().map(drop))?;
                tools::ensure_ffmpeg().map(passed)
            });
        });
        scope.spawn(|| {
            check("lints", &|| {
                let mut clippy = cargo(&["clippy", "--release", "--workspace", "--all-targets"]);
                counted(clippy.args(["--", "--deny", "warnings"]))
            });
            check("building the tests", &|| counted(cargo(&tests).arg("--no-run")));
            if fuzz::HERE {
                check("building for fuzzing", &|| fuzz::build(root).map(passed));
            }
        });
        let is_page_built = check("browser build", &|| web::build(root).map(passed));
        check("types of the JavaScript", &|| {
            counted(tools::npm(root).args(["run", "check"]))
        });
        is_page_built
    });
    // One after the other: a program in a browser is judged by its time, and tests of the crates take both of two cores.
    check("tests of the crates", &|| counted(&mut cargo(&tests)));
    if fuzz::HERE {
        check("fuzzing", &|| fuzz::check(root, FUZZING_S).map(passed));
    }
    let is_ready = is_page_built && check("program for the browsers", &|| build_program(root).map(passed));
    if is_ready {
        check("tests in Chromium", &|| counted(&mut in_browsers(root, &["test"])?));
    } else {
        eprintln!("no tests in browsers: there is no page or no program to test");
    }
    if is_ready && LINUX {
        check("Firefox and WebKit", &|| {
            // WebKitGTK's player is not steady enough for a check of every change.
            let mut tests = engine_tests(root)?;
            counted(tests.envs([
                ("DEEPSFT_ENGINES", "firefox,webkit"),
                ("DEEPSFT_CLIP_ENGINES", "firefox"),
            ]))
        });
    }

    println!();
    let row = |name: &str, Count { passed, failed }, time: Duration| {
        println!(
            "{name:<24} {passed:>5} passed {failed:>4} failed {:>6.0} s",
            time.as_secs_f64()
        );
    };
    let mut total = Count::default();
    for (name, count, time) in outcomes.into_inner().unwrap_or_else(PoisonError::into_inner) {
        row(name, count, time);
        total.passed += count.passed;
        total.failed += count.failed;
    }
    row("all, some side by side", total, began.elapsed());
    all_passed(total)
}

fn all_passed(Count { passed, failed }: Count) -> Result<()> {
    println!("{passed} passed, {failed} failed");
    ensure!(failed == 0, "{failed} of {} checks failed", passed + failed);
    Ok(())
}

/// Runs the tests of all crates with debug assertions and overflow checks in our own crates. Cargo keeps what it compiles for that
/// beside what it compiles for a release, and takes the crates of others from there.
pub fn assertions(root: &Path) -> Result<()> {
    let mut command = tools::cargo(root);
    command.args(["test", "--release", "--workspace", "--no-fail-fast", "--locked"]);
    for check in ["debug-assertions", "overflow-checks"] {
        command.args(["--config", &format!("profile.release.{check}=true")]);
        // All but those of the workspace.
        command.args(["--config", &format!("profile.release.package.\"*\".{check}=false")]);
    }
    all_passed(counted(&mut command)?)
}

/// Tests the page in Chromium, Firefox and WebKit, and leaves a table of what each engine does.
pub fn engines(root: &Path, build: bool) -> Result<()> {
    ensure!(LINUX, "Firefox and WebKit are tested on Linux only");
    prepare_browsers(root, build)?;
    all_passed(counted(&mut engine_tests(root)?)?)
}

/// Has the page and the package work for long, with the options of `www/bench/soak/soak.mjs`, and leaves samples and curves in `out`.
pub fn soak(root: &Path, build: bool, out: &Path, options: &[(&str, Option<String>)]) -> Result<()> {
    prepare_browsers(root, build)?;
    let mut command = in_browsers(root, &["run", "soak", "--"])?;
    for (name, value) in options {
        command.args(value.iter().flat_map(|value| [*name, value]));
    }
    tools::run(command.arg("--out").arg(out))
}

fn prepare_browsers(root: &Path, build: bool) -> Result<()> {
    tools::ensure_node_packages(root)?;
    if build {
        web::build(root)?;
        build_program(root)?;
    }
    Ok(())
}

/// The tests of `www/tests/engines`, in all three engines.
fn engine_tests(root: &Path) -> Result<Command> {
    let mut command = in_browsers(root, &["run", "test:engines"])?;
    for program in &tools::OTHER_ENGINES {
        command.env(program.variable, program.find()?);
    }
    Ok(command)
}

/// The command line program, which the tests in browsers ask for the same frames. It is built with the features of the whole
/// workspace, as the tests of the crates have left it.
fn build_program(root: &Path) -> Result<()> {
    tools::run(tools::cargo(root).args(["build", "--release", "--workspace", "--bin", "deepsft"]))
}

/// An `npm` command in `www/`, told which Chromium to run and where the command line program is.
fn in_browsers(root: &Path, arguments: &[&str]) -> Result<Command> {
    let program = format!("deepsft{}", env::consts::EXE_SUFFIX);
    let mut command = tools::npm(root);
    command.args(arguments);
    command.env(tools::CHROMIUM.variable, tools::CHROMIUM.find()?);
    command.env("DEEPSFT_CLI", tools::target_folder(root)?.join("release").join(program));
    Ok(command)
}

/// Runs a command, shows what it prints, and adds up the counts in it. A command without counts is one
/// check that passes or fails as a whole.
fn counted(command: &mut Command) -> Result<Count> {
    tools::announce(command);
    let mut child = command.stdout(Stdio::piped()).spawn().context("starting it")?;
    let Some(stdout) = child.stdout.take() else {
        bail!("its output cannot be read")
    };
    let mut count = Count::default();
    for line in BufReader::new(stdout).split(b'\n') {
        let line = String::from_utf8_lossy(&line?).into_owned();
        println!("{line}");
        if let Some(Count { passed, failed }) = count_in(&line) {
            count.passed += passed;
            count.failed += failed;
        }
    }
    let success = child.wait()?.success();
    if count == Count::default() {
        count.passed = u64::from(success);
    }
    if !success && count.failed == 0 {
        count.failed = 1;
    }
    Ok(count)
}

/// The count in a line of a test runner: Rust's "test result: ok. 3 passed; 1 failed; ...", and Node's "# pass 3" and "ℹ fail 1".
fn count_in(line: &str) -> Option<Count> {
    let line = line.trim();
    if let Some(result) = line.strip_prefix("test result: ") {
        let number = |name: &str| {
            let part = result.split([';', '.']).find_map(|part| part.strip_suffix(name))?;
            part.trim().parse().ok()
        };
        let (passed, failed) = (number("passed")?, number("failed")?);
        return Some(Count { passed, failed });
    }
    let line = line.strip_prefix("# ").or_else(|| line.strip_prefix("ℹ "))?;
    let number = |name: &str| line.strip_prefix(name)?.parse().ok();
    match (number("pass "), number("fail ")) {
        (None, None) => None,
        (passed, failed) => Some(Count {
            passed: passed.unwrap_or(0),
            failed: failed.unwrap_or(0),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_counts_of_rust_and_node_test_runners_are_read() {
        let count = |passed, failed| Some(Count { passed, failed });
        let rust = "test result: FAILED. 12 passed; 3 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s";
        assert_eq!(count_in(rust), count(12, 3));
        assert_eq!(count_in("# pass 7"), count(7, 0));
        assert_eq!(count_in("ℹ fail 2"), count(0, 2));
        for other in "# passes nothing,# duration_ms 7,pass 7,test a_test ... ok,".split(',') {
            assert_eq!(count_in(other), None, "{other}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_command_that_fails_without_a_count_is_one_failure() {
        for (script, passed, failed) in [
            ("true", 1, 0),
            ("exit 3", 0, 1),
            ("echo '# pass 4'; exit 1", 4, 1),
            ("echo '# pass 4'; echo '# fail 2'; exit 1", 4, 2),
        ] {
            let count = counted(Command::new("sh").args(["-c", script])).unwrap();
            assert_eq!(count, Count { passed, failed }, "{script}");
        }
        assert!(counted(&mut Command::new("no-such-program-here")).is_err());
    }
}
