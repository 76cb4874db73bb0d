//! The tables of the study.

use super::judging::{Attempt, FITTED_PX, FrameResult, START_PX};
use super::prints::Kind;
use crate::measuring::{Spread, median};
use clap::ValueEnum;

/// The row of the best attempts, when there are several finders.
const BEST: &str = "best of them";

/// Prints by finder and kind: shares of frames, then medians of times.
pub fn print(results: &[FrameResult]) {
    let Some(first) = results.first() else { return };
    let mut finders: Vec<&str> = first.attempts.iter().map(|attempt| attempt.finder).collect();
    if finders.len() > 1 {
        finders.push(BEST);
    }
    println!("prints          finder       frames   start  fitted   found   right     off   false");
    println!("                                    < {START_PX} px  < {FITTED_PX} px                          finds");
    let main = |kind: Kind| !matches!(kind, Kind::Repetitive | Kind::OfModel);
    let each_group = |row: fn(&str, &str, &[&FrameResult])| {
        for &finder in &finders {
            for &kind in Kind::value_variants().iter().chain(&[Kind::OfModel]) {
                let of_kind: Vec<_> = results.iter().filter(|r| r.kind == kind).collect();
                row(kind.name(), finder, &of_kind);
            }
            let first: Vec<_> = results.iter().filter(|r| main(r.kind)).collect();
            row("the first three", finder, &first);
        }
    };
    each_group(row);
    println!("Percent of the frames that show the print; false finds: of those that show another.");
    println!(
        "found: the image confirms enough of the visible print; right: and it is within {FITTED_PX} px; off: and it is not."
    );
    println!();
    println!("right sheets, median and 95th percentile    registration, px    visible points, mm    vertices, mm");
    each_group(errors);
    println!();
    println!("found sheets                  shape determined, %    vertices within 1 and 2 stated deviations, %");
    for &finder in &finders {
        let shown = results.iter().filter(|r| r.shown).filter_map(|r| attempt_of(r, finder));
        let found: Vec<_> = shown.filter(|attempt| attempt.is_found).collect();
        let within: Vec<_> = found.iter().filter_map(|attempt| attempt.within_deviations).collect();
        let mean = |k: usize| 100.0 * within.iter().map(|within| within[k]).sum::<f64>() / within.len().max(1) as f64;
        let determined = 100.0 * within.len() as f64 / found.len().max(1) as f64;
        println!(
            "{finder:14} {:6} {determined:17.1} {:20.1} {:6.1}",
            found.len(),
            mean(0),
            mean(1)
        );
    }
    println!();
    println!("medians, ms     features   find    fit");
    for finder in finders {
        let attempts = || {
            let shown = results.iter().filter(|r| r.shown);
            shown.filter_map(move |r| attempt_of(r, finder))
        };
        let time = |of: fn(&Attempt) -> f64| median(attempts().map(of)).unwrap_or_default();
        if finder != BEST {
            println!(
                "{finder:14} {:9.0} {:6.0} {:6.0}",
                time(|a| a.features_ms),
                time(|a| a.find_ms),
                time(|a| a.fit_ms)
            );
        }
    }
}

/// Prints the errors of what is found and right.
fn errors(prints: &str, finder: &str, results: &[&FrameResult]) {
    let shown = results.iter().filter(|r| r.shown);
    let attempts = shown.filter_map(|r| attempt_of(r, finder));
    let right: Vec<_> = attempts.filter(|a| a.is_found && a.is_fitted()).collect();
    let errors: [fn(&Attempt) -> Option<f64>; 3] = [|a| a.fitted_px, |a| a.points_rmse_mm, |a| a.vertices_rmse_mm];
    let spreads = errors.map(|error| Spread::of(right.iter().filter_map(|a| error(a))));
    let [Some(px), Some(points), Some(vertices)] = spreads else {
        return;
    };
    let row = [px, points, vertices].map(|errors| format!("{:10.2} {:8.2}", errors.median, errors.p95));
    println!("{prints:15} {finder:12} {:6}        {}", right.len(), row.join(" "));
}

fn attempt_of<'a>(result: &'a FrameResult, finder: &str) -> Option<&'a Attempt> {
    if finder == BEST {
        return result.best();
    }
    result.attempts.iter().find(|attempt| attempt.finder == finder)
}

fn row(prints: &str, finder: &str, results: &[&FrameResult]) {
    let (mut shown, mut absent) = (Vec::new(), Vec::new());
    for result in results {
        let attempts = if result.shown { &mut shown } else { &mut absent };
        attempts.extend(attempt_of(result, finder));
    }
    if shown.is_empty() {
        return;
    }
    let percent = |attempts: &[&Attempt], holds: &dyn Fn(&Attempt) -> bool| {
        let count = attempts.iter().filter(|attempt| holds(attempt)).count();
        100.0 * count as f64 / attempts.len().max(1) as f64
    };
    println!(
        "{prints:15} {finder:12} {:6} {:7.1} {:7.1} {:7.1} {:7.1} {:7.1} {:7.2}",
        shown.len(),
        percent(&shown, &|a| a.start_px.is_some_and(|error| error < START_PX)),
        percent(&shown, &Attempt::is_fitted),
        percent(&shown, &|a| a.is_found),
        percent(&shown, &|a| a.is_found && a.is_fitted()),
        percent(&shown, &|a| a.is_found && !a.is_fitted()),
        percent(&absent, &|a| a.is_found),
    );
}
