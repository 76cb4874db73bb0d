//! Sets of joined things are those of a flood.

use deepsft_geometry::DisjointSets;

#[test]
fn sets_are_those_of_a_flood_whatever_the_order_of_joins() {
    // Things k and k + 7 (of 30) in an order that jumps: the sets are the remainders by 7.
    let mut sets = DisjointSets::new(29);
    assert_eq!(sets.add(), 29);
    for k in (0..23).map(|k| k * 10 % 23) {
        sets.join(k + 7, k);
    }
    for thing in 0..30 {
        assert_eq!(sets.first(thing), thing % 7);
    }
    sets.join(29, 28);
    sets.join(28, 29);
    assert_eq!((sets.first(22), sets.first(0), sets.first(2)), (0, 0, 2));
}
