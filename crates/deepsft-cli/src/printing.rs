//! Printing to readers that may go away, as `head` does. The macros take the place of the standard ones of the same
//! names everywhere in this program: those panic when the other end of the pipe is closed.

use crate::failure;
use std::fmt;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::process;

/// Exit code when the reader of the output went away: what shells show for a program that SIGPIPE ended.
const READER_GONE: i32 = 141;

/// [`std::print`], but a reader that went away ends the program quietly.
macro_rules! print {
    ($($part:tt)*) => { $crate::printing::to_stdout(format_args!($($part)*)) };
}

/// [`std::println`], but a reader that went away ends the program quietly.
macro_rules! println {
    () => { $crate::printing::to_stdout(format_args!("\n")) };
    ($($part:tt)*) => { $crate::printing::to_stdout(format_args!("{}\n", format_args!($($part)*))) };
}

/// [`std::eprintln`], but what nobody can read is dropped.
macro_rules! eprintln {
    ($($part:tt)*) => { $crate::printing::to_stderr(format_args!("{}\n", format_args!($($part)*))) };
}

/// Writes to the standard output. What the command has not done by then stays undone, as with any program in a pipe;
/// files are whole or not there.
pub fn to_stdout(text: fmt::Arguments<'_>) {
    if let Err(error) = stdout().write_fmt(text) {
        if error.kind() == ErrorKind::BrokenPipe {
            process::exit(READER_GONE);
        }
        to_stderr(format_args!("error: could not write to the standard output: {error}\n"));
        process::exit(failure::FAILED.into());
    }
}

/// Writes to the standard error.
pub fn to_stderr(text: fmt::Arguments<'_>) {
    // Nothing is left to tell it to.
    let _ = stderr().write_fmt(text);
}
