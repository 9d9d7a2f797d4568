//! Tests of mattes with cast shadows, and with floor visible between parts of the animal.

mod around;
mod dark_wall;

use super::*;
use crate::analysis::Params;
use crate::analysis::scene::background::Background;
use crate::analysis::silhouette;
use crate::raster::{ColorSpec, RgbImage};

const SIZE: [u32; 2] = [120, 90];
const PAPER: u8 = 170;
const FUR: u8 = 30;

/// A matte of an animal 60 pixels long, and the shade of each pixel of its frame.
struct Drawn {
    matte: Matte,
    shade: fn(u32, u32) -> u8,
}

fn picture(shade: fn(u32, u32) -> u8) -> Frame {
    let [width, height] = SIZE;
    let pixels = (0..width * height).flat_map(|k| [shade(k % width, k / width); 3]);
    let image = RgbImage {
        width,
        height,
        pixels: pixels.collect(),
    };
    let mut frame = Frame::new(width, height, ColorSpec::default());
    frame.draw_rgb(&image, Rect::of_size(width, height));
    frame
}

fn drawn(shade: fn(u32, u32) -> u8) -> Drawn {
    drawn_on(|_, _| PAPER, shade)
}

fn drawn_on(ground: fn(u32, u32) -> u8, shade: fn(u32, u32) -> u8) -> Drawn {
    let scene = Scene::with(ground, shade);
    let matte = scene.cut(shade).matte;
    Drawn { matte, shade }
}

/// A scene, and the colors of an animal in it.
struct Scene {
    ground: fn(u32, u32) -> u8,
    background: Background,
    coat: Coat,
}

impl Scene {
    fn with(ground: fn(u32, u32) -> u8, shade: fn(u32, u32) -> u8) -> Scene {
        let [width, height] = SIZE;
        let sigma = vec![1.5; (width * height) as usize];
        let background = Background::new(picture(ground), sigma, Params::default().threshold);
        let silhouette = silhouette_of(ground, shade);
        let frame = picture(shade);
        let difference =
            silhouette::difference(&frame, &background, &Light::NEUTRAL, silhouette.rect);
        let coat = Coat::learn(&[(difference, &background, silhouette)], true);
        Scene {
            ground,
            background,
            coat,
        }
    }

    fn cut(&self, shade: fn(u32, u32) -> u8) -> Pulled {
        let view = View {
            frame: &picture(shade),
            background: &self.background,
            light: &Light::NEUTRAL,
            coat: &self.coat,
            ignored: &[],
        };
        pull(&view, &silhouette_of(self.ground, shade), 60.0)
    }
}

fn silhouette_of(ground: fn(u32, u32) -> u8, shade: fn(u32, u32) -> u8) -> Mask {
    let [width, height] = SIZE;
    let mut silhouette = Mask::new(Rect::of_size(width, height));
    for k in 0..width * height {
        silhouette.bits[k as usize] =
            u8::from(ground(k % width, k / width).abs_diff(shade(k % width, k / width)) > 9);
    }
    silhouette.fill_holes();
    silhouette
}

/// Returns the color and alpha at a place of the frame.
fn pixel_of(matte: &Matte, [x, y]: [u32; 2]) -> [u8; 4] {
    let rect = matte.rect;
    if !(rect.x..rect.right()).contains(&x) || !(rect.y..rect.bottom()).contains(&y) {
        return [0; 4];
    }
    let k = 4 * ((y - rect.y) * rect.w + x - rect.x) as usize;
    [0, 1, 2, 3].map(|c| matte.image.pixels[k + c])
}

impl Drawn {
    /// Returns the color and alpha at a place of the frame.
    fn pixel(&self, x: u32, y: u32) -> [u8; 4] {
        pixel_of(&self.matte, [x, y])
    }

    /// Returns the shade of the matte over a background of shade `back`.
    fn over(&self, back: u8, [x, y]: [u32; 2]) -> f64 {
        let [shade, .., alpha] = self.pixel(x, y).map(f64::from);
        f64::from(back) + (shade - f64::from(back)) * alpha / 255.0
    }

    fn reproduces_its_frame(&self) {
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let (shown, wanted) = (self.over(PAPER, [x, y]), f64::from((self.shade)(x, y)));
            assert!(
                (shown - wanted).abs() < 9.0,
                "{shown} for {wanted} at {x}, {y}"
            );
        }
    }
}

/// Returns the number of steps from a pixel outside a box to the box; 0 inside.
fn steps_away([x, y]: [u32; 2], body: Rect) -> u32 {
    let beyond =
        |at: u32, first: u32, n: u32| first.saturating_sub(at) + (at + 1).saturating_sub(first + n);
    beyond(x, body.x, body.w).max(beyond(y, body.y, body.h))
}

/// A dark body; `with_shadow` draws a fading shadow around it.
const BODY: Rect = Rect {
    x: 30,
    y: 25,
    w: 30,
    h: 16,
};

fn with_shadow(x: u32, y: u32) -> u8 {
    match steps_away([x, y], BODY) {
        0 => FUR,
        d => PAPER - 38u8.saturating_sub(9 * (d.min(6) - 1) as u8),
    }
}

#[test]
fn shadow_is_no_part_of_the_matte() {
    let drawn = drawn(with_shadow);
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let alpha = drawn.pixel(x, y)[3];
        match steps_away([x, y], BODY) {
            0 => assert_eq!(alpha, 255, "the body at {x}, {y}"),
            1 => {}
            2 => assert!(alpha < 70, "beside the body at {x}, {y}: {alpha}"),
            _ => assert!(alpha < 8, "its shadow at {x}, {y}: {alpha}"),
        }
    }
}

/// A body with a spot of the paper's shade, and two thin parts that meet at both ends.
fn with_gaps(x: u32, y: u32) -> u8 {
    let body = Rect {
        x: 20,
        y: 20,
        w: 40,
        h: 30,
    };
    let spot = Rect {
        x: 36,
        y: 32,
        w: 7,
        h: 7,
    };
    let tail = Rect {
        x: 60,
        y: 30,
        w: 45,
        h: 16,
    };
    let between = Rect {
        x: 60,
        y: 34,
        w: 41,
        h: 8,
    };
    let is_in = |rect: Rect| steps_away([x, y], rect) == 0;
    match (is_in(spot) || is_in(between), is_in(body) || is_in(tail)) {
        (false, true) => FUR,
        _ => PAPER,
    }
}

#[test]
fn light_spot_on_the_body_is_opaque_and_floor_between_thin_parts_is_clear() {
    let drawn = drawn(with_gaps);
    drawn.reproduces_its_frame();
    assert_eq!(drawn.pixel(39, 35)[3], 255, "the spot");
    assert_eq!(drawn.pixel(75, 31)[3], 255, "a thin part");
    for (x, y) in (36..40).flat_map(|y| (66..96).map(move |x| (x, y))) {
        assert_eq!(drawn.pixel(x, y)[3], 0, "between, at {x}, {y}");
    }
}

/// At the right edge of the body the background (101) has nearly the shade of the body (100).
fn light_stripe(x: u32, _: u32) -> u8 {
    if x < 58 { 50 } else { 101 }
}

fn with_bright_edge(x: u32, y: u32) -> u8 {
    match (steps_away([x, y], BODY), x) {
        (0, ..58) => 100,
        (0, _) => 140,
        _ => light_stripe(x, y),
    }
}

#[test]
fn pixel_unlike_background_and_body_keeps_its_color() {
    let drawn = drawn_on(light_stripe, with_bright_edge);
    for x in [58, 59] {
        assert_eq!(drawn.pixel(x, 32), [140, 140, 140, 255], "{x}");
    }
}

/// A floor that is brighter on the right.
fn lit_from_the_right(x: u32, _: u32) -> u8 {
    if x < 65 { 150 } else { 240 }
}

/// A dark body on the left, its paler tail on the right, and two shadows of the tail from two lamps.
fn with_two_shadows(x: u32, y: u32) -> u8 {
    let floor = lit_from_the_right(x, y);
    let is_along = (60..105).contains(&x);
    match (steps_away([x, y], BODY), y) {
        (0, _) => FUR,
        (_, 31..35) if is_along => floor / 4,
        (_, 22..26 | 40..44) if is_along => (f32::from(floor) * 0.82) as u8,
        _ => floor,
    }
}

#[test]
fn shadow_on_brighter_floor_is_removed() {
    let drawn = drawn_on(lit_from_the_right, with_two_shadows);
    for x in 67..103 {
        assert_eq!(drawn.pixel(x, 32)[3], 255, "the tail at {x}");
        for y in (22..26).chain(40..44) {
            assert_eq!(drawn.pixel(x, y)[3], 0, "the shadow at {x}, {y}");
        }
    }
}

/// A floor with a darker stripe.
fn striped_floor(x: u32, _: u32) -> u8 {
    if (62..66).contains(&x) { 116 } else { PAPER }
}

/// A body with a pale ear on the striped floor, in its own shadow.
fn with_a_pale_ear(x: u32, y: u32) -> u8 {
    let is_ear = (BODY.right() - 6..BODY.right() + 1).contains(&x) && (28..38).contains(&y);
    let is_cast = (BODY.right()..70).contains(&x) && (26..40).contains(&y);
    match (is_ear, steps_away([x, y], BODY), is_cast) {
        (true, ..) => 105,
        (_, 0, _) => FUR,
        (.., true) => striped_floor(x, y) / 20 * 17,
        _ => striped_floor(x, y),
    }
}

#[test]
fn shadow_on_floor_of_the_animals_color_is_removed() {
    let drawn = drawn_on(striped_floor, with_a_pale_ear);
    for (x, y) in (30..36).flat_map(|y| (62..66).map(move |x| (x, y))) {
        let alpha = drawn.pixel(x, y)[3];
        assert!(alpha < 80, "{alpha} at {x}, {y}");
    }
}

fn black(_: u32, _: u32) -> u8 {
    0
}

/// A light animal with a thin loop; inside the loop the ground is hardly brighter than black.
fn with_a_loop(x: u32, y: u32) -> u8 {
    const LOOP: Rect = Rect {
        x: 66,
        y: 26,
        w: 14,
        h: 14,
    };
    match (steps_away([x, y], BODY), steps_away([x, y], LOOP)) {
        (0, _) => 200,
        (_, 1..=3) => 120,
        (_, 0) => 4,
        _ => 0,
    }
}

#[test]
fn black_floor_has_no_shadow() {
    let drawn = drawn_on(black, with_a_loop);
    assert_eq!(drawn.pixel(64, 33)[3], 255, "the loop");
    for (x, y) in (30..36).flat_map(|y| (70..76).map(move |x| (x, y))) {
        assert_eq!(drawn.pixel(x, y), [0; 4], "{x}, {y}");
    }
}

fn gray(_: u32, _: u32) -> u8 {
    100
}

/// A light body with a tail that fills half of each pixel of one row and a quarter in the next row.
fn with_a_thin_tail(x: u32, y: u32) -> u8 {
    let along = (60..90).contains(&x);
    match (steps_away([x, y], BODY), along, y) {
        (0, ..) => 240,
        (_, true, 31) => 170,
        (_, true, 32) => 135,
        _ => gray(x, y),
    }
}

#[test]
fn thin_tail_mixes_body_and_floor() {
    let drawn = drawn_on(gray, with_a_thin_tail);
    for x in 70..88 {
        assert_eq!(drawn.pixel(x, 31), [240, 240, 240, 128], "{x}");
        assert!((drawn.over(100, [x, 32]) - 135.0).abs() < 2.0, "{x}");
    }
}
