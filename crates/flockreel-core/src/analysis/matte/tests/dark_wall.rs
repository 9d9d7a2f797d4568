//! Tests of mattes in front of things darker than the animal's ground, such as a wall.

use super::*;

const WALL: u8 = 50;

/// Paper in front of a dark wall.
fn wall(x: u32, _: u32) -> u8 {
    if x < 70 { PAPER } else { WALL }
}

/// A dark body, its shadow on the paper, and its image in the wall, in one place as dark as the body.
fn with_image(x: u32, y: u32) -> u8 {
    let is_cast = (BODY.right()..100).contains(&x) && (28..38).contains(&y);
    let is_clear = (80..92).contains(&x) && (30..36).contains(&y);
    match (steps_away([x, y], BODY), is_clear, is_cast) {
        (0, ..) | (_, true, _) => FUR,
        (_, _, true) => wall(x, y) - wall(x, y) / 5,
        _ => wall(x, y),
    }
}

#[test]
fn image_in_a_dark_wall_and_shadow_before_it_are_left_out() {
    let drawn = drawn_on(wall, with_image);
    for (x, y) in (29..37).flat_map(|y| (64..100).map(move |x| (x, y))) {
        assert_eq!(drawn.pixel(x, y)[3], 0, "{x}, {y}");
    }
}

/// A body half in front of the wall, and an image farther along the wall, as dark as the body.
fn with_image_across_the_wall(x: u32, y: u32) -> u8 {
    let is_image = (92..102).contains(&x) && (29..36).contains(&y);
    if is_image { FUR } else { across_the_wall(x, y) }
}

#[test]
fn image_too_large_for_a_limb_is_left_out() {
    let drawn = drawn_on(wall, with_image_across_the_wall);
    assert_eq!(drawn.pixel(80, 33)[3], 255, "the body");
    for (x, y) in (29..36).flat_map(|y| (92..102).map(move |x| (x, y))) {
        assert_eq!(drawn.pixel(x, y)[3], 0, "{x}, {y}");
    }
}

/// Nearly black, slightly lighter on the left.
fn nearly_black(x: u32, _: u32) -> u8 {
    if x < 62 { 4 } else { 1 }
}

/// A light animal on it, in two parts, one of them dimmer.
fn in_the_dark(x: u32, y: u32) -> u8 {
    let is_leg = (64..76).contains(&x) && (30..34).contains(&y);
    match (steps_away([x, y], BODY), is_leg) {
        (0, _) => 200,
        (_, true) => 120,
        _ => nearly_black(x, y),
    }
}

/// Paper with a dark stripe.
fn striped(x: u32, _: u32) -> u8 {
    if (64..84).contains(&x) { WALL } else { PAPER }
}

/// A body with a tail, a part of which is hidden in front of the stripe.
fn with_a_hidden_part(x: u32, y: u32) -> u8 {
    let is_tail = ((60..64).contains(&x) || (68..84).contains(&x)) && (30..33).contains(&y);
    if steps_away([x, y], BODY) == 0 || is_tail {
        FUR
    } else {
        striped(x, y)
    }
}

#[test]
fn limb_apart_from_the_body_is_kept() {
    let light = drawn_on(nearly_black, in_the_dark);
    let tail = drawn_on(striped, with_a_hidden_part);
    for x in 70..74 {
        assert_eq!(light.pixel(x, 32)[3], 255, "the leg at {x}");
        assert_eq!(tail.pixel(x, 31)[3], 255, "the tail at {x}");
    }
}

/// A dark body, half of it in front of the wall.
fn across_the_wall(x: u32, y: u32) -> u8 {
    match steps_away([x.saturating_sub(25), y], BODY) {
        0 => FUR,
        _ => wall(x, y),
    }
}

#[test]
fn animal_in_front_of_a_dark_wall_is_whole() {
    let drawn = drawn_on(wall, across_the_wall);
    for (x, y) in (25..41).flat_map(|y| (55..85).map(move |x| (x, y))) {
        let shown = drawn.over(240, [x, y]);
        assert!((shown - f64::from(FUR)).abs() < 4.0, "{shown} at {x}, {y}");
    }
}

/// A body with a shadow, and an image in the wall that is larger than the body.
fn with_a_large_image(x: u32, y: u32) -> u8 {
    let is_cast = (BODY.right()..68).contains(&x) && (28..38).contains(&y);
    let is_image = x >= 72 && (18..48).contains(&y);
    match (steps_away([x, y], BODY), is_cast, is_image) {
        (0, ..) => FUR,
        (_, true, _) => PAPER / 5 * 4,
        (.., true) => WALL - 12,
        _ => wall(x, y),
    }
}

#[test]
fn large_image_does_not_make_the_shadow_opaque() {
    let drawn = drawn_on(wall, with_a_large_image);
    for (x, y) in (29..37).flat_map(|y| (63..68).map(move |x| (x, y))) {
        assert_eq!(drawn.pixel(x, y)[3], 0, "{x}, {y}");
    }
}
