//! How a command fails: the message and the exit code.

use crate::interruption::{self, Interrupted};
use deepsft_formats::{FormatError, read_error};
use deepsft_synth::SynthError;
use deepsft_train::TrainError;
use std::path::Path;
use std::process::ExitCode;
use thiserror::Error;

/// Exit code when work failed although command line and inputs were fine.
pub const FAILED: u8 = 1;

/// Exit code of a wrong command line; clap exits with the same.
const USAGE: u8 = 2;

/// Exit code when an input is missing, corrupt or unfit.
const INVALID_INPUT: u8 = 3;

/// Marks an error as a contradiction on the command line that the parser cannot see.
#[derive(Debug, Error)]
#[error("{0}")]
struct Usage(String);

/// Marks an error whose causes were told when they came: what is left is the exit code.
#[derive(Debug, Error)]
#[error("not every input could be used")]
struct Told(u8);

/// Lays an error at the door of the input `path`, a `what` ("camera file").
pub trait BlameInput<T> {
    /// The same result, its error with file and exit code 3.
    fn blame(self, what: &'static str, path: &Path) -> anyhow::Result<T>;
}

impl<T, E: Into<anyhow::Error>> BlameInput<T> for Result<T, E> {
    fn blame(self, what: &'static str, path: &Path) -> anyhow::Result<T> {
        self.map_err(|error| FormatError::unusable(what, path, message(&worded(error.into(), path))).into())
    }
}

/// The cause in words, without the name of the input `path`, which stands before it.
fn worded(error: anyhow::Error, path: &Path) -> anyhow::Error {
    let error = match error.downcast::<FormatError>() {
        Ok(FormatError::File { reason, path: own }) if own == path => anyhow::Error::msg(reason),
        Ok(error) => error.into(),
        Err(error) => error,
    };
    match error.downcast::<std::io::Error>() {
        Ok(error) => read_error(error).into(),
        Err(error) => error,
    }
}

/// An error of the command line (exit code 2).
pub fn usage(message: impl Into<String>) -> anyhow::Error {
    Usage(message.into()).into()
}

/// Prints an error, unless that was done, and gives its exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    if !error.is::<Told>() {
        tell(error);
    }
    ExitCode::from(code(error))
}

/// Prints an error on a line of its own.
pub fn tell(error: &anyhow::Error) {
    eprintln!("error: {}", message(error));
}

/// Ends a command some of whose inputs failed, which was told; an unfit one gives the exit code.
pub fn ended(failures: &[anyhow::Error]) -> anyhow::Result<()> {
    (failures.iter().map(code).max()).map_or(Ok(()), |code| Err(Told(code).into()))
}

/// The whole chain on one line, outermost first.
pub fn message(error: &anyhow::Error) -> String {
    format!("{error:#}")
}

/// Whether a library lays the error at the door of an input.
fn is_unusable(error: &(dyn std::error::Error + 'static)) -> bool {
    let format = match (error.downcast_ref(), error.downcast_ref()) {
        (Some(TrainError::Format(format) | TrainError::Synth(SynthError::Format(format))), _) => Some(format),
        (_, Some(SynthError::Format(format))) => Some(format),
        _ => error.downcast_ref(),
    };
    matches!(format, Some(FormatError::Unusable { .. }))
}

fn code(error: &anyhow::Error) -> u8 {
    if let Some(Told(code)) = error.downcast_ref() {
        *code
    } else if error.is::<Usage>() {
        USAGE
    } else if error.chain().any(is_unusable) {
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
        assert_eq!(code(&anyhow::Error::msg("disk full")), FAILED);
        assert_eq!(code(&Interrupted.into()), 130);
        assert!(ended(&[]).is_ok());
        let failures = [error, anyhow::Error::msg("disk full")];
        assert_eq!(code(&ended(&failures).unwrap_err()), INVALID_INPUT);
    }
}
