//! `deepsft camera board`: a ChArUco board on paper.

use crate::failure::usage;
use crate::numbers::positive;
use crate::output::canvas::Canvas;
use crate::output::lettering::{Align, Lettering};
use anyhow::Result;
use calib_targets_aruco::builtins::DICT_4X4_50;
use calib_targets_charuco::{CharucoBoard, CharucoBoardSpec};
use clap::Args;
use deepsft::encode_png;
use deepsft_geometry::Picture;
use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};
use std::path::PathBuf;
use std::str::FromStr;

/// Side of a marker as a fraction of its square's.
const MARKER_FRACTION: f64 = 0.75;

/// Pages that boards are printed on, the smallest that holds it first: mm, lying across.
const PAGES: [[f64; 2]; 3] = [[297.0, 210.0], [420.0, 297.0], [594.0, 420.0]];

/// White around the board, mm: printers do not reach the edge, and the markers need light around them.
const MARGIN_MM: f64 = 10.0;

/// Pixels of a PNG per mm: 300 a inch.
const PIXELS_PER_MM: f64 = 300.0 / 25.4;

/// White bits reach so far beyond their cells, mm: no hairline of black is left between neighbours.
const OVERLAP_MM: f64 = 0.02;

/// PDF user units (1/72 inch) in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;

#[derive(Args)]
#[command(after_help = "\
Print it at 100 % (\"actual size\"), glue it to something flat and stiff (a pane of glass is best), and measure a square.
OpenCV calls this board CharucoBoard with DICT_4X4_50 and markers of 0.75 squares.

Example:
  deepsft camera board --out board.pdf")]
pub struct BoardArguments {
    /// File to write: .pdf or .png (300 pixels an inch)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Squares across and down
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "9x6")]
    squares: Squares,
    /// Side of a square, mm
    #[arg(long, value_name = "MM", default_value = "30", value_parser = positive)]
    square_mm: f64,
}

/// Squares across and down a board, typed as `9x6`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Squares {
    columns: u32,
    rows: u32,
}

impl FromStr for Squares {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let count = |side: &str| side.trim().parse().ok().filter(|count| (3..=50).contains(count));
        let sides = text.split_once(['x', 'X', '×']);
        sides
            .and_then(|(columns, rows)| {
                Some(Self {
                    columns: count(columns)?,
                    rows: count(rows)?,
                })
            })
            .ok_or_else(|| "expected squares across and down, from 3 to 50, such as 9x6".to_owned())
    }
}

impl Squares {
    /// The ChArUco board with these squares of `square_mm`.
    pub fn charuco(self, square_mm: f64) -> Result<CharucoBoardSpec> {
        let spec = CharucoBoardSpec::new(
            self.rows,
            self.columns,
            square_mm as f32,
            MARKER_FRACTION as f32,
            DICT_4X4_50,
        );
        // Every second square has a marker, and there are 50.
        CharucoBoard::new(spec).map_err(|error| usage(format!("no such board: {error}")))?;
        Ok(spec)
    }
}

/// A rectangle of the page, mm from its top left corner.
struct Patch {
    left: f64,
    top: f64,
    side: f64,
    is_black: bool,
}

pub fn run(arguments: &BoardArguments) -> Result<()> {
    let spec = arguments.squares.charuco(arguments.square_mm)?;
    let board = [spec.cols, spec.rows].map(|count| f64::from(count) * arguments.square_mm);
    let Some(page) = PAGES
        .iter()
        .find(|page| (0..2).all(|k| board[k] + 2.0 * MARGIN_MM <= page[k]))
    else {
        return Err(usage(format!(
            "a board of {} x {} mm fits no page up to A2",
            board[0], board[1]
        )));
    };
    let patches = patches(&spec, arguments.square_mm, *page);
    let words = format!(
        "deepsft camera calibrate --charuco {}x{}   |   squares of {} mm: print at 100 % and measure",
        spec.cols, spec.rows, arguments.square_mm
    );
    let extension = arguments.out.extension().unwrap_or_default().to_ascii_lowercase();
    let bytes = match extension.to_str() {
        Some("png") => encode_png(&drawn(&patches, *page, &words))?,
        Some("pdf") => pdf(&patches, *page, &words),
        _ => return Err(usage("--out must end in .pdf or .png")),
    };
    deepsft_formats::write_file(&arguments.out, &bytes)?;
    println!(
        "{} on a page of {} x {} mm: {}",
        words.replace("   |   ", "; "),
        page[0],
        page[1],
        arguments.out.display()
    );
    Ok(())
}

/// Black squares, the top left one among them, and in each white one the next marker: black with white bits.
fn patches(spec: &CharucoBoardSpec, square: f64, page: [f64; 2]) -> Vec<Patch> {
    let [left, top] =
        [(page[0], spec.cols), (page[1], spec.rows)].map(|(page, count)| (page - f64::from(count) * square) / 2.0);
    let bits = spec.dictionary.marker_size();
    let cell = MARKER_FRACTION * square / (bits + 2) as f64;
    let mut patches = Vec::new();
    let mut codes = spec.dictionary.codes().iter();
    for row in 0..spec.rows {
        for column in 0..spec.cols {
            let (x, y) = (left + f64::from(column) * square, top + f64::from(row) * square);
            if (row + column) % 2 == 0 {
                patches.push(Patch {
                    left: x,
                    top: y,
                    side: square,
                    is_black: true,
                });
                continue;
            }
            let inset = (1.0 - MARKER_FRACTION) / 2.0 * square;
            patches.push(Patch {
                left: x + inset,
                top: y + inset,
                side: MARKER_FRACTION * square,
                is_black: true,
            });
            let code = codes.next().copied().unwrap_or_default();
            let white = (0..bits * bits).filter(|bit| code >> bit & 1 == 0);
            patches.extend(white.map(|bit| Patch {
                left: x + inset + (bit % bits + 1) as f64 * cell - OVERLAP_MM,
                top: y + inset + (bit / bits + 1) as f64 * cell - OVERLAP_MM,
                side: cell + 2.0 * OVERLAP_MM,
                is_black: false,
            }));
        }
    }
    patches
}

fn drawn(patches: &[Patch], page: [f64; 2], words: &str) -> Picture {
    let [width, height] = page.map(|side| (side * PIXELS_PER_MM).round());
    let mut canvas = Canvas::new(width as usize, height as usize, [255; 3]);
    for patch in patches {
        let [left, top, side] = [patch.left, patch.top, patch.side].map(|length| length * PIXELS_PER_MM);
        canvas.fill(left, top, side, side, if patch.is_black { [0; 3] } else { [255; 3] });
    }
    let lettering = Lettering::regular(3.0 * PIXELS_PER_MM, [0; 3]);
    canvas.write(
        words,
        (width / 2.0, height - 5.0 * PIXELS_PER_MM),
        Align::Centre,
        lettering,
    );
    canvas.into_picture()
}

fn pdf(patches: &[Patch], [width, height]: [f64; 2], words: &str) -> Vec<u8> {
    let [catalog, pages, page, content, font] = [1, 2, 3, 4, 5].map(Ref::new);
    let points = |mm: f64| (mm * POINTS_PER_MM) as f32;
    let mut pdf = Pdf::new();
    let mut description = pdf.catalog(catalog);
    description.pages(pages);
    description
        .viewer_preferences()
        .pair(Name(b"PrintScaling"), Name(b"None"));
    description.finish();
    pdf.pages(pages).kids([page]).count(1);
    let mut sheet = pdf.page(page);
    sheet
        .media_box(Rect::new(0.0, 0.0, points(width), points(height)))
        .parent(pages)
        .contents(content);
    sheet.resources().fonts().pair(Name(b"F"), font);
    sheet.finish();
    pdf.type1_font(font).base_font(Name(b"Helvetica"));
    let mut drawing = Content::new();
    for patch in patches {
        drawing.set_fill_gray(if patch.is_black { 0.0 } else { 1.0 });
        let bottom = height - patch.top - patch.side;
        drawing
            .rect(
                points(patch.left),
                points(bottom),
                points(patch.side),
                points(patch.side),
            )
            .fill_nonzero();
    }
    drawing.set_fill_gray(0.0).begin_text().set_font(Name(b"F"), 8.0);
    drawing
        .next_line(points(MARGIN_MM), points(4.0))
        .show(Str(words.as_bytes()))
        .end_text();
    pdf.stream(content, &drawing.finish());
    pdf.finish()
}
