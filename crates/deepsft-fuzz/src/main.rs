//! The fuzz target that the variable `DEEPSFT_FUZZ_TARGET` names, under libFuzzer. Without it the names of all targets are
//! printed. `cargo xtask fuzz` runs it.
#![no_main]

use deepsft_fuzz::Target;
use std::path::Path;
use std::sync::OnceLock;
use std::{env, fs, process};

/// What one input may take, bytes.
const MAX_MEMORY: u64 = 1 << 30;

static TARGET: OnceLock<&Target> = OnceLock::new();

libfuzzer_sys::fuzz_target!(init: begin(), |input: &[u8]| {
    let Some(target) = TARGET.get() else { return };
    let memory = allocation_counter::measure(|| {
        if let Err(error) = (target.read)(input) {
            // The message is made as for a person.
            assert!(!format!("{error:#}").is_empty(), "an error without words");
        }
    });
    assert!(memory.bytes_max <= MAX_MEMORY, "it took {} bytes of memory", memory.bytes_max);
});

/// Finds the target and writes its seeds into the folder `DEEPSFT_FUZZ_SEEDS`.
fn begin() {
    let Ok(name) = env::var("DEEPSFT_FUZZ_TARGET") else {
        deepsft_fuzz::TARGETS
            .iter()
            .for_each(|target| println!("{}", target.name));
        process::exit(0);
    };
    let Some(target) = Target::named(&name) else {
        eprintln!("there is no target {name}");
        process::exit(2);
    };
    if let Some(folder) = env::var_os("DEEPSFT_FUZZ_SEEDS")
        && let Err(error) = write_seeds(target, Path::new(&folder))
    {
        eprintln!("the seeds of {name} cannot be written: {error:#}");
        process::exit(2);
    }
    TARGET.get_or_init(|| target);
}

fn write_seeds(target: &Target, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder)?;
    for (number, seed) in (target.seeds)()?.iter().enumerate() {
        fs::write(folder.join(format!("seed-{number}")), seed)?;
    }
    Ok(())
}
