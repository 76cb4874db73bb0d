//! Distances between descriptors: the inner loop of matching. `pulp` chooses the instructions of the machine at run time
//! (population counts, on x86-64 beyond its baseline), without `unsafe` here.

use crate::descriptor::Descriptor;

/// Writes the distance of `query` to each of `others` and gives the first nearest one: its index and distance. Without others
/// the distance is the largest number.
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
