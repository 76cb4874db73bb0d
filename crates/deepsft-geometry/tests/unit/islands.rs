//! Small pieces of the maps.

use deepsft_geometry::{Maps, remove_islands};

fn maps(rows: &[&str]) -> Maps {
    let mut maps = Maps::empty((rows[0].len(), rows.len()));
    for (pixel, mark) in rows.concat().bytes().enumerate() {
        if mark == b'#' {
            maps.set(pixel, 500.0, [0.5; 2]);
        }
    }
    maps
}

#[test]
fn a_piece_is_joined_by_sides_however_it_winds() {
    // One spiral of 30, one U of 7 whose arms meet last, one pixel that touches the spiral at a corner only.
    let drawn = [
        "########..#.#",
        "#......#..#.#",
        "#.####.#..###",
        "#.#..#.#.....",
        "#.#....#.....",
        "#.######.....",
        ".#...........",
    ];
    let mut all = maps(&drawn);
    assert_eq!(remove_islands(&mut all, 0.0), 0);
    assert_eq!(all, maps(&drawn));
    assert_eq!(remove_islands(&mut all, 0.2), 1);
    assert!(!all.inside(6 * 13 + 1) && all.inside(10) && all.inside(5 * 13 + 4));
    assert_eq!(remove_islands(&mut all, 0.3), 7);
    assert!(!all.inside(10) && all.inside(0));
}

#[test]
fn pieces_do_not_join_around_the_end_of_a_row() {
    let mut two = maps(&["....##", "#.....", "......"]);
    assert_eq!(remove_islands(&mut two, 0.6), 1);
    assert!(two.inside(4) && !two.inside(6));
}

#[test]
fn nothing_and_everything_have_no_island() {
    let mut nothing = Maps::empty((7, 5));
    assert_eq!(remove_islands(&mut nothing, 1.0), 0);
    let mut everything = maps(&["###", "###"]);
    assert_eq!(remove_islands(&mut everything, 1.0), 0);
}
