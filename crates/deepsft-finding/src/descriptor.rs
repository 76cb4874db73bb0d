//! Binary descriptors: comparisons of pairs of blurred pixels (BRIEF, Calonder et al. 2010), turned with the corner.

use crate::corners::Corner;
use crate::pyramid::PyramidLevel;
use std::sync::LazyLock;

const WORDS: usize = 4;

/// Comparisons in a descriptor.
pub(crate) const BITS: u32 = 64 * WORDS as u32;

/// Directions in which the pattern stands ready.
const TURNS: usize = 64;

/// Farthest that a compared pixel lies from the corner, pixels.
const REACH: f32 = 15.0;

/// Deviation of the compared pixels from the corner, pixels.
const SPREAD: f32 = 6.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Descriptor(pub(crate) [u64; WORDS]);

impl Descriptor {
    // Always: its place may be compiled for instructions beyond the baseline.
    #[inline(always)]
    pub fn distance(&self, other: &Self) -> u16 {
        let differing = self.0.iter().zip(other.0).map(|(a, b)| (a ^ b).count_ones() as u16);
        differing.sum()
    }

    pub fn of(level: &PyramidLevel, corner: &Corner) -> Self {
        let turn = (corner.angle / std::f32::consts::TAU * TURNS as f32).round() as i32;
        let pattern = &PATTERNS[turn.rem_euclid(TURNS as i32) as usize];
        let centre = usize::from(corner.y) * level.width + usize::from(corner.x);
        let value =
            |[x, y]: [i8; 2]| level.smooth[centre.wrapping_add_signed(y as isize * level.width as isize + x as isize)];
        let mut words = [0; WORDS];
        for (word, pairs) in words.iter_mut().zip(pattern.as_chunks::<64>().0) {
            for (bit, [a, b]) in pairs.iter().enumerate() {
                *word |= u64::from(value(*a) < value(*b)) << bit;
            }
        }
        Self(words)
    }
}

/// Compared pairs of pixels around the corner, for each direction.
static PATTERNS: LazyLock<Vec<Vec<[[i8; 2]; 2]>>> = LazyLock::new(|| {
    let pairs = pairs();
    let turned = |turn: usize| {
        let (sin, cos) = (turn as f32 / TURNS as f32 * std::f32::consts::TAU).sin_cos();
        let place = |[x, y]: [f32; 2]| [(cos * x - sin * y).round() as i8, (sin * x + cos * y).round() as i8];
        pairs.iter().map(|pair| pair.map(place)).collect()
    };
    (0..TURNS).map(turned).collect()
});

/// Numbers without a pattern (Marsaglia 2003).
pub(crate) fn xorshift(mut state: u64) -> impl FnMut() -> u64 {
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    }
}

/// Pairs of points drawn from a normal distribution around the corner, cut off at [`REACH`].
fn pairs() -> Vec<[[f32; 2]; 2]> {
    let mut random = xorshift(0x9e37_79b9_7f4a_7c15);
    let mut uniform = move || (random() >> 40) as f32 / (1 << 24) as f32;
    let mut point = move || loop {
        // Twelve uniform numbers make a normal one.
        let mut normal = || (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
        let p = [normal() * SPREAD, normal() * SPREAD];
        if p[0].hypot(p[1]) <= REACH - 0.5 {
            return p;
        }
    };
    (0..BITS).map(|_| [point(), point()]).collect()
}

/// Writes the distance of `query` to each of `others` and gives the first nearest one: its index and distance. Without others
/// the distance is the largest number. `pulp` chooses the instructions of the machine at run time (population counts, on x86-64 beyond
/// its baseline), without `unsafe` here.
pub(crate) fn distances(query: &Descriptor, others: &[Descriptor], distances: &mut Vec<u16>) -> (usize, u16) {
    distances.resize(others.len(), 0);
    #[cfg(target_arch = "x86_64")]
    if let Some(instructions) = pulp::x86::V3::try_new() {
        return instructions.vectorize(
            #[inline(always)]
            || written(query, others, distances),
        );
    }
    written(query, others, distances)
}

// Inlined into the function that is compiled for the machine's instructions.
#[inline(always)]
fn written(query: &Descriptor, others: &[Descriptor], distances: &mut [u16]) -> (usize, u16) {
    let (mut nearest, mut least) = (0, u16::MAX);
    for (i, (other, distance)) in others.iter().zip(distances).enumerate() {
        *distance = query.distance(other);
        if *distance < least {
            (nearest, least) = (i, *distance);
        }
    }
    (nearest, least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::xorshift;

    #[test]
    fn every_distance_is_the_count_of_differing_bits_and_the_first_nearest_is_named() {
        let mut random = xorshift(3);
        let mut all: Vec<Descriptor> = (0..533)
            .map(|_| Descriptor([random(), random(), random(), random()]))
            .collect();
        all.extend([Descriptor([0; 4]), Descriptor([u64::MAX; 4])]);
        let bits = |d: &Descriptor| -> Vec<bool> {
            let word = |w: u64| (0..64).map(move |k| w >> k & 1 == 1);
            d.0.into_iter().flat_map(word).collect()
        };
        let mut found = Vec::new();
        for query in all.iter().step_by(66).chain(&all[533..]) {
            let one = |other: &Descriptor| bits(query).iter().zip(bits(other)).filter(|&(a, b)| *a != b).count();
            let expected: Vec<usize> = all.iter().map(one).collect();
            let nearest = distances(query, &all, &mut found);
            assert!(found.iter().map(|&d| usize::from(d)).eq(expected.iter().copied()));
            let first = expected.iter().enumerate().min_by_key(|&(_, d)| *d);
            assert_eq!(Some((nearest.0, &usize::from(nearest.1))), first);
        }
        // A shorter list leaves nothing of the one before.
        assert_eq!(distances(&all[0], &all[..2], &mut found), (0, 0));
        assert_eq!(found.len(), 2);
        assert_eq!(distances(&all[0], &[], &mut found), (0, u16::MAX));
    }
}
