//! Natural order of numbered file names: `2.png` before `10.png`.

use std::cmp::Ordering;

/// Compares two names. Runs of digits compare by value, and by length if the values are equal.
///
/// Example: `a2`, `a02`, `a10`, `b1` are in this order.
pub(super) fn compare_natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let (piece_a, rest_a) = first_piece(a);
        let (piece_b, rest_b) = first_piece(b);
        let is_number = |piece: &str| piece.starts_with(|c: char| c.is_ascii_digit());
        let order = if is_number(piece_a) && is_number(piece_b) {
            by_value(piece_a, piece_b)
        } else {
            piece_a.cmp(piece_b)
        };
        if order.is_ne() || piece_a.is_empty() {
            return order;
        }
        (a, b) = (rest_a, rest_b);
    }
}

/// Splits off a run of digits, or otherwise one character.
fn first_piece(text: &str) -> (&str, &str) {
    let n_digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let n_bytes = match n_digits {
        0 => text.chars().next().map_or(0, char::len_utf8),
        n => n,
    };
    text.split_at(n_bytes)
}

fn by_value(a: &str, b: &str) -> Ordering {
    let (value_a, value_b) = (a.trim_start_matches('0'), b.trim_start_matches('0'));
    let by_length = value_a.len().cmp(&value_b.len());
    by_length
        .then_with(|| value_a.cmp(value_b))
        .then_with(|| a.len().cmp(&b.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_compare_by_value_and_letters_by_character() {
        let sorted = [
            "", "a", "a1.png", "a2.png", "a02.png", "a10.png", "a10b", "b1", "é1", "é2",
        ];
        let mut names = sorted;
        names.reverse();
        names.sort_by(|a, b| compare_natural(a, b));
        assert_eq!(names, sorted);
    }
}
