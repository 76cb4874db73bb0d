//! How a command fails: the message and the exit code.

use crate::interruption::{self, Interrupted};
use anyhow::Error;
use deepsft_formats::FormatError;
use deepsft_synth::SynthError;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exit code when work failed although command line and inputs were fine.
pub const FAILED: u8 = 1;

/// Exit code of a wrong command line; clap exits with the same.
const USAGE: u8 = 2;

/// Exit code when an input is missing, corrupt or unfit.
const INVALID_INPUT: u8 = 3;

/// Marks an error as the fault of an input. The cause comes after it in the chain.
#[derive(Debug)]
struct InvalidInput {
    what: &'static str,
    path: PathBuf,
}

impl fmt::Display for InvalidInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot use {} {}", self.what, self.path.display())
    }
}

/// Marks an error as a contradiction on the command line that the parser cannot see.
#[derive(Debug)]
struct Usage(String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Marks an error whose causes were told when they came: what is left is the exit code.
#[derive(Debug)]
struct Told(u8);

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not every input could be used")
    }
}

impl std::error::Error for Told {}

/// Lays an error at the door of the input `path`, a `what` ("camera file").
pub trait BlameInput<T> {
    /// The same result, its error with file and exit code 3.
    fn blame(self, what: &'static str, path: &Path) -> anyhow::Result<T>;
}

impl<T, E: Into<Error>> BlameInput<T> for Result<T, E> {
    fn blame(self, what: &'static str, path: &Path) -> anyhow::Result<T> {
        self.map_err(|error| {
            error.into().context(InvalidInput {
                what,
                path: path.to_path_buf(),
            })
        })
    }
}

/// An error of the command line (exit code 2).
pub fn usage(message: impl Into<String>) -> Error {
    Usage(message.into()).into()
}

/// Prints an error, unless that was done, and gives its exit code.
pub fn report(error: &Error) -> ExitCode {
    if !error.is::<Told>() {
        tell(error);
    }
    ExitCode::from(code(error))
}

/// Prints an error on a line of its own.
pub fn tell(error: &Error) {
    eprintln!("error: {}", message(error));
}

/// Ends a command some of whose inputs failed, which was told; an unfit one gives the exit code.
pub fn ended(failures: &[Error]) -> anyhow::Result<()> {
    (failures.iter().map(code).max()).map_or(Ok(()), |code| Err(Told(code).into()))
}

/// The whole chain on one line, outermost first.
pub fn message(error: &Error) -> String {
    format!("{error:#}")
}

/// Whether a library lays the error at the door of an input.
fn is_unusable(error: &(dyn std::error::Error + 'static)) -> bool {
    matches!(error.downcast_ref(), Some(FormatError::Unusable { .. }))
        || matches!(
            error.downcast_ref(),
            Some(SynthError::Format(FormatError::Unusable { .. }))
        )
}

fn code(error: &Error) -> u8 {
    if let Some(Told(code)) = error.downcast_ref() {
        *code
    } else if error.is::<Usage>() {
        USAGE
    } else if error.is::<InvalidInput>() || error.chain().any(is_unusable) {
        INVALID_INPUT
    } else if error.is::<Interrupted>() {
        interruption::EXIT_CODE
    } else {
        FAILED
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn the_message_names_the_file_and_the_cause_and_the_code_tells_whose_fault_it_is() {
        let cause: Result<(), _> = Err(std::io::Error::other("it is a potato"));
        let error = cause
            .blame("camera file", Path::new("a/b.json"))
            .context("while starting")
            .unwrap_err();
        assert_eq!(
            message(&error),
            "while starting: cannot use camera file a/b.json: it is a potato"
        );
        assert_eq!(code(&error), INVALID_INPUT);
        let read = deepsft_formats::read_camera(Path::new("nowhere/camera.json"));
        let error = read.context("while starting").unwrap_err();
        assert!(message(&error).starts_with("while starting: cannot use camera file nowhere/camera.json: "));
        assert_eq!(code(&error), INVALID_INPUT);
        assert_eq!(code(&usage("no")), USAGE);
        assert_eq!(message(&usage("no")), "no");
        assert_eq!(code(&Error::msg("disk full")), FAILED);
        assert_eq!(code(&Interrupted.into()), 130);
        assert!(ended(&[]).is_ok());
        let failures = [error, Error::msg("disk full")];
        assert_eq!(code(&ended(&failures).unwrap_err()), INVALID_INPUT);
    }
}
