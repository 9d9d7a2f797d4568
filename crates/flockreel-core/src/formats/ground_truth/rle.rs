//! Run lengths of COCO masks: alternating counts of clear and set pixels, column by column, and their text
//! encoding.
//!
//! Source: `maskApi` of pycocotools. Each count is stored as its difference to the count two places before,
//! in base-32 digits, lowest first.

use std::iter::once;

use crate::geometry::Rect;

/// Returns the counts of a mask in a picture of `size_px`. Pixels outside `rect` are clear. The first count
/// is of clear pixels; the sum is the number of pixels of the picture.
pub fn counts(size_px: [u32; 2], rect: Rect, is_set: impl Fn(u32, u32) -> bool) -> Vec<u32> {
    let height = size_px[1];
    let mut edges = Vec::new();
    let mut end = None;
    for x in rect.x..rect.right() {
        for y in (rect.y..rect.bottom()).filter(|&y| is_set(x, y)) {
            let at = x * height + y;
            if end != Some(at) {
                edges.extend(end);
                edges.push(at);
            }
            end = Some(at + 1);
        }
    }
    edges.extend(end);
    let starts = once(0).chain(edges.iter().copied());
    let ends = edges.iter().copied().chain(once(size_px[0] * height));
    starts.zip(ends).map(|(start, end)| end - start).collect()
}

/// Returns the counts in COCO's text encoding.
pub fn text(counts: &[u32]) -> String {
    let mut text = String::new();
    for (k, &count) in counts.iter().enumerate() {
        let before = if k > 2 { counts[k - 2] } else { 0 };
        let mut rest = i64::from(count) - i64::from(before);
        loop {
            let low = (rest & 0x1f) as u8;
            rest >>= 5;
            // Stop when the rest only repeats the sign, which is the highest bit of the digit.
            let done = rest == if low & 0x10 == 0 { 0 } else { -1 };
            text.push(char::from(48 + low + if done { 0 } else { 0x20 }));
            if done {
                break;
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the counts of a text, or `None` if it is malformed.
    fn read(text: &str) -> Option<Vec<u32>> {
        let mut counts: Vec<u32> = Vec::new();
        let (mut value, mut shift) = (0i64, 0);
        for byte in text.bytes() {
            let letter = i64::from(byte.checked_sub(48)?);
            if letter > 0x3f || shift > 35 {
                return None;
            }
            value |= (letter & 0x1f) << shift;
            shift += 5;
            if letter & 0x20 == 0 {
                if letter & 0x10 != 0 {
                    value |= -1 << shift;
                }
                let before = if counts.len() > 2 {
                    counts[counts.len() - 2]
                } else {
                    0
                };
                counts.push(u32::try_from(value + i64::from(before)).ok()?);
                (value, shift) = (0, 0);
            }
        }
        (shift == 0).then_some(counts)
    }

    #[test]
    fn counts_are_by_column_and_start_with_clear_pixels() {
        // . #
        // # #
        let set = |x, y| x == 1 || y == 1;
        assert_eq!(counts([2, 2], Rect::of_size(2, 2), set), [1, 3, 0]);
        assert_eq!(counts([2, 2], Rect::default(), set), [4]);
        assert_eq!(counts([2, 2], Rect::of_size(2, 2), |_, _| true), [0, 4, 0]);
    }

    #[test]
    fn text_is_that_of_pycocotools() {
        // pycocotools.mask.encode of a 4 x 6 (rows x columns) array, set in rows 1 and 2 of columns 2..5.
        let square = |x: u32, y: u32| (1..3).contains(&y) && (2..5).contains(&x);
        let found = counts([6, 4], Rect::of_size(6, 4), square);
        assert_eq!(found, [9, 2, 2, 2, 2, 2, 5]);
        assert_eq!(text(&found), "9220003");
    }

    proptest! {
        #[test]
        fn counts_are_restored_from_their_text(counts in prop::collection::vec(0u32..3_000_000, 0..40)) {
            prop_assert_eq!(read(&text(&counts)), Some(counts));
        }

        #[test]
        fn mask_is_restored_from_its_counts(
            bits in prop::collection::vec(any::<bool>(), 35),
            left in 0u32..3, top in 0u32..3,
        ) {
            let rect = Rect { x: left, y: top, w: 5, h: 7 };
            let is_set = |x: u32, y: u32| bits[((y - top) * 5 + x - left) as usize];
            let size_px = [9, 10];
            let mut back = Vec::new();
            for (k, &count) in counts(size_px, rect, is_set).iter().enumerate() {
                back.extend(vec![k % 2 == 1; count as usize]);
            }
            prop_assert_eq!(back.len(), 90);
            for (at, &set) in (0u32..).zip(&back) {
                let (x, y) = (at / 10, at % 10);
                prop_assert_eq!(set, rect.contains(x, y) && is_set(x, y));
            }
        }
    }
}
