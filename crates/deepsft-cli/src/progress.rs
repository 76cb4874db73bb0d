//! The one style of progress bars. They go to stderr and only to a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that counts `length` things of a kind ("frames").
pub fn counting(length: u64, things: &'static str) -> ProgressBar {
    bar(
        length,
        &format!("{{bar:30}} {{pos}}/{{len}} {things}, {{per_sec}}, {{eta}} left  {{msg}}"),
    )
}

/// A bar that shows which fraction is done, and a message.
pub fn fraction() -> ProgressBar {
    bar(FRACTION_LENGTH, "{bar:30} {percent:>3} %  {msg}")
}

/// Length of a [`fraction`] bar: its position when all is done.
pub const FRACTION_LENGTH: u64 = 1000;

fn bar(length: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
