//! What the DeepSfT paper's tables say (its tables of rectangular and volumic templates, of monocular depth, and of speed).

use crate::table::Row;

/// One of the paper's tables.
pub struct Table {
    /// The sets of its columns.
    pub sets: &'static str,
    /// Row, mean RMSE of depth in mm and of registration in pixels for each set, frames per second on a GTX 1080.
    rows: &'static [(&'static str, [&'static str; 3])],
}

/// Rectangular templates, synthetic.
pub static SYNTHETIC_SHEETS: Table = Table {
    sets: "DS1S / DS2S",
    rows: &[
        ("CH17+GTR", ["6.89 / 6.89", "-", "0.75"]),
        ("CH17R+GTR", ["8.27 / 8.27", "-", "0.19"]),
        ("CH17+DOF", ["15.60 / 28.26", "-", "0.75"]),
        ("CH17R+DOF", ["15.41 / 28.04", "-", "0.19"]),
        ("DOF", ["-", "4.63 / 5.91", "8.84"]),
        ("NGO15", ["18.77 / 21.32", "-", "0.03"]),
        ("HDM-Net", ["10.80 / 9.92", "-", "25.12"]),
        ("IsMo-GAN", ["7.32 / 6.94", "-", "10.47"]),
        ("R50F", ["7.99 / 7.75", "6.69 / 6.13", "37.00"]),
        ("DeepSfT", ["1.68 / 1.63", "1.87 / 1.34", "20.40"]),
    ],
};

/// Rectangular templates, filmed.
pub static REAL_SHEETS: Table = Table {
    sets: "DS1R / DS2R / DS5R, real",
    rows: &[
        ("CH17+DOF", ["38.12 / 27.31 / 22.57", "-", "0.75"]),
        ("CH17R+DOF", ["34.24 / 25.24 / 19.42", "-", "0.19"]),
        ("NGO15", ["- / - / 32.3", "-", "0.03"]),
        ("DenseDepth", ["93.87 / - / 395.53", "-", "-"]),
        ("DenseDepth+FT", ["51.25 / - / 22.47", "-", "-"]),
        ("BTS", ["89.22 / - / 84.45", "-", "-"]),
        ("BTS+FT", ["14.76 / - / 12.34", "-", "-"]),
        ("R50F", ["17.53 / 14.45 / 16.30", "5.02 / 4.13 / 6.33", "37.00"]),
        ("DeepSfT", ["9.51 / 7.37 / 6.97", "2.32 / 1.53 / 2.74", "20.40"]),
    ],
};

/// Volumic templates, synthetic.
pub static SYNTHETIC_SOLIDS: Table = Table {
    sets: "DS3S / DS4S",
    rows: &[
        ("CH17+GTR", ["45.21 / 73.80", "-", "0.75"]),
        ("CH17R+GTR", ["43.67 / 70.70", "-", "0.19"]),
        ("R50F", ["6.34 / 12.62", "7.14 / 8.93", "37.00"]),
        ("DeepSfT", ["1.16 / 1.57", "1.05 / 3.60", "20.40"]),
    ],
};

impl Table {
    /// Puts the paper's figures beside the rows of the same name, and appends those that nothing stands beside, with the reason.
    pub fn fill(&self, rows: &mut Vec<Row>) {
        for (label, figures) in self.rows {
            let of_network = format!("{label}, network");
            let is_beside = |row: &&mut Row| row.label == *label || row.label == of_network;
            if let Some(row) = rows.iter_mut().find(is_beside) {
                row.paper = Some(*figures);
                continue;
            }
            let missing = match *label {
                "R50F" | "DeepSfT" => "not trained here in full width",
                _ => "needs the frames of a video",
            };
            rows.push(Row {
                label: (*label).to_owned(),
                missing: Some(missing.to_owned()),
                paper: Some(*figures),
                ..Row::default()
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_figures_stand_beside_our_rows_and_none_of_its_rows_is_left_out() {
        let row = |label: &str| Row {
            label: label.to_owned(),
            ..Row::default()
        };
        let mut rows = vec![row("NGO15"), row("R50F, network"), row("ours, network")];
        SYNTHETIC_SHEETS.fill(&mut rows);
        let paper = |label: &str| rows.iter().find(|row| row.label == label).and_then(|row| row.paper);
        assert_eq!(paper("NGO15"), Some(["18.77 / 21.32", "-", "0.03"]));
        assert_eq!(paper("R50F, network").map(|figures| figures[1]), Some("6.69 / 6.13"));
        assert_eq!(paper("ours, network"), None);
        let appended: Vec<_> = rows[3..].iter().filter_map(|row| row.missing.as_deref()).collect();
        assert_eq!(appended.len(), SYNTHETIC_SHEETS.rows.len() - 2);
        for missing in ["needs the frames of a video", "not trained here in full width"] {
            assert!(appended.contains(&missing), "{missing}");
        }
    }
}
