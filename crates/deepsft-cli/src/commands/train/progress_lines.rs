//! What a training tells: steps in the bar, measurements as lines that stay.

use crate::progress;
use deepsft_train::{CurvePoint, Progress};
use indicatif::ProgressBar;

/// Shows `told` in the bar or above it.
pub fn tell(bar: &ProgressBar, told: Progress) {
    match told {
        Progress::Resumed { samples, seconds } => {
            bar.suspend(|| println!("going on after {samples} samples and {:.1} minutes", seconds / 60.0));
        }
        Progress::Step {
            fraction,
            samples,
            seconds,
            loss,
        } => {
            bar.set_position((fraction * progress::FRACTION_LENGTH as f64) as u64);
            let left = seconds / fraction.max(1e-6) * (1.0 - fraction).max(0.0);
            let (rate, loss, left) = (samples as f64 / seconds, number(loss), duration(left));
            bar.set_message(format!(
                "{samples} samples, {rate:.1} per second, loss {loss}, {left} left"
            ));
        }
        Progress::Evaluated(point) => bar.suspend(|| println!("{}", line(&point))),
        _ => {}
    }
}

fn line(point: &CurvePoint) -> String {
    let (minutes, samples, loss) = (point.seconds / 60.0, point.samples, number(point.loss));
    let mut line = format!("{minutes:7.1} min {samples:9} samples  loss {loss}");
    let figures = [
        ("registration", point.registration_rmse_px, 2, " px"),
        ("depth", point.depth_rmse_mm, 2, " mm"),
        ("mask IoU", point.mask_iou, 3, ""),
        ("E_pr", point.photo_consistency_error, 4, ""),
    ];
    for (name, value, digits, unit) in figures {
        if let Some(value) = value {
            line += &format!("  {name} {value:.digits$}{unit}");
        }
    }
    line
}

/// A loss with three digits that say something.
fn number(loss: f64) -> String {
    if loss.is_nan() {
        "not measured".to_owned()
    } else if (0.01..1e4).contains(&loss.abs()) {
        format!("{loss:.3}")
    } else {
        format!("{loss:.2e}")
    }
}

fn duration(seconds: f64) -> String {
    if seconds < 90.0 {
        format!("{seconds:.0} s")
    } else {
        format!("{:.0} min", seconds / 60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_what_was_measured_and_nothing_else() {
        let point = CurvePoint {
            samples: 70,
            seconds: 90.0,
            loss: 0.000_123,
            learning_rate: 1e-3,
            registration_rmse_px: None,
            depth_rmse_mm: Some(12.345),
            mask_iou: None,
            photo_consistency_error: Some(0.1234),
        };
        let told = line(&point);
        assert!(told.ends_with("loss 1.23e-4  depth 12.35 mm  E_pr 0.1234"), "{told}");
        let without = line(&CurvePoint {
            loss: f64::NAN,
            ..point
        });
        assert!(without.contains("loss not measured  depth"), "{without}");
        assert_eq!(
            (duration(89.4), duration(600.0)),
            ("89 s".to_owned(), "10 min".to_owned())
        );
    }
}
