//! Parts of a data set.

use crate::DatasetPart;

#[test]
fn parts_are_all_of_it_once() {
    for (count, of) in [(10, 3), (2, 4), (60_000, 7), (u64::MAX / 2, 5)] {
        let mut next = 11;
        for number in 1..=of {
            let indices = format!("{number}/{of}")
                .parse::<DatasetPart>()
                .unwrap()
                .indices(11, count);
            assert_eq!(indices.start, next);
            assert!((indices.end - indices.start).abs_diff(count / of) <= 1);
            next = indices.end;
        }
        assert_eq!(next, 11 + count);
    }
}

#[test]
fn parts_are_counted_from_one() {
    let part: DatasetPart = "2/8".parse().unwrap();
    assert_eq!((part.number(), part.of()), (2, 8));
    for text in ["0/4", "5/4", "1/0", "1", "a/b", "-1/2", "1/2/3"] {
        assert!(text.parse::<DatasetPart>().is_err(), "{text}");
    }
}
