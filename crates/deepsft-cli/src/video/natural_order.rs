//! The order in which people number files: `frame-2` before `frame-10`.

use std::cmp::Ordering;

/// Compares names part by part, runs of digits by their value. Names that differ in leading zeros only are ordered as
/// texts.
pub fn compare(a: &str, b: &str) -> Ordering {
    let (mut rest_a, mut rest_b) = (a, b);
    while let (Some(first_a), Some(first_b)) = (rest_a.chars().next(), rest_b.chars().next()) {
        let (part_a, part_b);
        if first_a.is_ascii_digit() && first_b.is_ascii_digit() {
            (part_a, rest_a) = split_digits(rest_a);
            (part_b, rest_b) = split_digits(rest_b);
            // Without leading zeros the longer number is the greater, however long they are.
            let (number_a, number_b) = (part_a.trim_start_matches('0'), part_b.trim_start_matches('0'));
            let order = number_a.len().cmp(&number_b.len()).then(number_a.cmp(number_b));
            if order != Ordering::Equal {
                return order;
            }
        } else if first_a == first_b {
            (rest_a, rest_b) = (&rest_a[first_a.len_utf8()..], &rest_b[first_b.len_utf8()..]);
        } else {
            return first_a.cmp(&first_b);
        }
    }
    rest_a.len().cmp(&rest_b.len()).then(a.cmp(b))
}

fn split_digits(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    text.split_at(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_by_their_value_and_texts_by_their_letters() {
        let ordered = [
            "1.png",
            "2.png",
            "10.png",
            "99999999999999999999999.png",
            "a.png",
            "a2b1.png",
            "a2b02.png",
            "a2b2.png",
            "a10.png",
            "b1.png",
        ];
        for (i, a) in ordered.iter().enumerate() {
            for (j, b) in ordered.iter().enumerate() {
                assert_eq!(compare(a, b), i.cmp(&j), "{a} and {b}");
            }
        }
    }
}
