//! Tests of thin parts of the animal.

use super::*;

/// Shade of a tail: as dark as a shadow may be.
const TAIL: u8 = 80;

fn is_tail(x: u32, y: u32) -> bool {
    (BODY.right()..100).contains(&x) && (31..34).contains(&y)
}

/// A dark body with a fading shadow and a gray tail.
fn with_a_gray_tail(x: u32, y: u32) -> u8 {
    if is_tail(x, y) {
        TAIL
    } else {
        with_shadow(x, y)
    }
}

#[test]
fn tail_as_gray_as_a_shadow_is_kept() {
    let drawn = drawn_above(39, |_, _| PAPER, with_a_gray_tail);
    for x in BODY.right()..98 {
        let alpha = drawn.pixel(x, 32)[3];
        assert!(alpha > 150, "the tail at {x}: {alpha}");
    }
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let is_away = (0..5).all(|d| {
            !is_tail(x, (y + 2).saturating_sub(d)) && !is_tail((x + 2).saturating_sub(d), y)
        });
        if is_away && steps_away([x, y], BODY) > 2 {
            let alpha = drawn.pixel(x, y)[3];
            assert!(alpha < 8, "the shadow at {x}, {y}: {alpha}");
        }
    }
}
