//! `deepsft camera board`: a ChArUco board on paper.

use crate::failure::usage;
use crate::numbers::positive;
use crate::output::canvas::Canvas;
use crate::output::lettering::{Align, Lettering};
use anyhow::Result;
use clap::Args;
use deepsft::encode_png;
use deepsft_calibration::{Board, BoardPatch};
use deepsft_geometry::Picture;
use deepsft_geometry::glam::DVec2;
use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, Str};
use std::path::PathBuf;
use std::str::FromStr;

/// Pages that boards are printed on, the smallest that holds it first: mm, lying across.
const PAGES: [[f64; 2]; 3] = [[297.0, 210.0], [420.0, 297.0], [594.0, 420.0]];

/// White around the board, mm: printers do not reach the edge, and the markers need light around them.
const MARGIN_MM: f64 = 10.0;

/// Pixels of a PNG per mm: 300 a inch.
const PIXELS_PER_MM: f64 = 300.0 / 25.4;

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
    pub fn board(self, square_mm: f64) -> Result<Board> {
        Board::new(self.columns, self.rows, square_mm).map_err(|error| usage(error.to_string()))
    }
}

pub fn run(arguments: &BoardArguments) -> Result<()> {
    let (Squares { columns, rows }, square_mm) = (arguments.squares, arguments.square_mm);
    let board = arguments.squares.board(square_mm)?;
    let size = board.size_mm();
    let holds = |page: &DVec2| (size + 2.0 * MARGIN_MM).cmple(*page).all();
    let Some(page) = PAGES.into_iter().map(DVec2::from).find(holds) else {
        return Err(usage(format!(
            "a board of {} x {} mm fits no page up to A2",
            size.x, size.y
        )));
    };
    let patches = board.patches((page - size) / 2.0);
    let words = format!(
        "deepsft camera calibrate --charuco {columns}x{rows}   |   squares of {square_mm} mm: print at 100 % and measure"
    );
    let extension = arguments.out.extension().unwrap_or_default().to_ascii_lowercase();
    let bytes = match extension.to_str() {
        Some("png") => encode_png(&drawn(&patches, page, &words))?,
        Some("pdf") => pdf(&patches, page, &words),
        _ => return Err(usage("--out must end in .pdf or .png")),
    };
    deepsft_formats::write_file(&arguments.out, &bytes)?;
    let (words, out) = (words.replace("   |   ", "; "), arguments.out.display());
    println!("{words} on a page of {} x {} mm: {out}", page.x, page.y);
    Ok(())
}

fn drawn(patches: &[BoardPatch], page: DVec2, words: &str) -> Picture {
    let page = (page * PIXELS_PER_MM).round();
    let mut canvas = Canvas::new(page.x as usize, page.y as usize, [255; 3]);
    for patch in patches {
        let (corner, side) = (patch.top_left * PIXELS_PER_MM, patch.side * PIXELS_PER_MM);
        let color = if patch.is_black { [0; 3] } else { [255; 3] };
        canvas.fill(corner.x, corner.y, side, side, color);
    }
    let lettering = Lettering::regular(3.0 * PIXELS_PER_MM, [0; 3]);
    let below = (page.x / 2.0, page.y - 5.0 * PIXELS_PER_MM);
    canvas.write(words, below, Align::Centre, lettering);
    canvas.into_picture()
}

fn pdf(patches: &[BoardPatch], size: DVec2, words: &str) -> Vec<u8> {
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
        .media_box(Rect::new(0.0, 0.0, points(size.x), points(size.y)))
        .parent(pages)
        .contents(content);
    sheet.resources().fonts().pair(Name(b"F"), font);
    sheet.finish();
    pdf.type1_font(font).base_font(Name(b"Helvetica"));
    let mut drawing = Content::new();
    for patch in patches {
        drawing.set_fill_gray(if patch.is_black { 0.0 } else { 1.0 });
        let (left, bottom) = (points(patch.top_left.x), points(size.y - patch.top_left.y - patch.side));
        let side = points(patch.side);
        drawing.rect(left, bottom, side, side).fill_nonzero();
    }
    drawing.set_fill_gray(0.0).begin_text().set_font(Name(b"F"), 8.0);
    drawing
        .next_line(points(MARGIN_MM), points(4.0))
        .show(Str(words.as_bytes()))
        .end_text();
    pdf.stream(content, &drawing.finish());
    pdf.finish()
}
