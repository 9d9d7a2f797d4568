//! Tests of placed sprites: exact copies where possible, smooth interpolation elsewhere.

use super::*;
use crate::raster::Canvas;

fn checkered(width: u32, height: u32) -> Vec<u8> {
    (0..width * height)
        .flat_map(|k| [(k * 7 % 256) as u8, (k * 13 % 256) as u8, 90, 255])
        .collect()
}

fn place(center_px: [f64; 2]) -> Placement {
    Placement {
        center_px,
        rotation_rad: 0.0,
        scale: 1.0,
        mirrored: false,
    }
}

/// Prepares the visible part of a sprite of `size` pixels; the middle of the whole sprite is placed.
fn cut(rgba: &[u8], [width, height]: [u32; 2], scale: f64) -> Premultiplied {
    let bounds = bounds_of(rgba, width);
    let rows = (bounds.y..bounds.bottom()).flat_map(|y| {
        let at = ((y * width + bounds.x) * 4) as usize;
        &rgba[at..at + bounds.w as usize * 4]
    });
    let shown: Vec<u8> = rows.copied().collect();
    let middle = |side: u32, from: u32| f64::from(side) / 2.0 - f64::from(from);
    let middle_px = [middle(width, bounds.x), middle(height, bounds.y)];
    Premultiplied::new(&shown, [bounds.w, bounds.h], middle_px, scale)
}

fn drawn_with(rgba: &[u8], (w, h): (u32, u32), place: &Placement, cpu: Level) -> Resampled {
    let sprite = cut(rgba, [w, h], place.scale);
    let mut resampled = Resampled::default();
    let size = [40, 30];
    resampled.draw(&sprite, place, Viewport { size, nearer: None }, cpu);
    resampled
}

fn drawn(rgba: &[u8], size: (u32, u32), place: &Placement) -> Resampled {
    drawn_with(rgba, size, place, Level::detect())
}

fn alpha_sum(resampled: &Resampled) -> f64 {
    let alphas = resampled.pixels.iter().map(|p| f64::from(p[3]));
    alphas.sum::<f64>() / f64::from(ONE)
}

fn pixel(resampled: &Resampled, x: u32, y: u32) -> [u8; 4] {
    let rect = resampled.rect;
    if !rect.contains(x, y) {
        return [0; 4];
    }
    let at = ((y - rect.y) * rect.w + x - rect.x) as usize;
    crate::raster::canvas::straight(resampled.pixels[at])
}

#[test]
fn whole_pixel_placement_copies_every_pixel() {
    let rgba = checkered(6, 4);
    let plain = drawn(&rgba, (6, 4), &place([13.0, 12.0]));
    let mirrored = Placement {
        mirrored: true,
        ..place([13.0, 12.0])
    };
    let mirrored = drawn(&rgba, (6, 4), &mirrored);
    for y in 0..4 {
        for x in 0..6 {
            let want: [u8; 4] = rgba[((y * 6 + x) * 4) as usize..][..4].try_into().unwrap();
            assert_eq!(pixel(&plain, 10 + x, 10 + y), want);
            assert_eq!(pixel(&mirrored, 15 - x, 10 + y), want);
        }
    }
    assert_eq!(alpha_sum(&plain), 24.0, "nothing is drawn outside");
}

#[test]
fn quarter_turn_clockwise_moves_right_to_down() {
    let mut rgba = vec![0; 8 * 8 * 4];
    // One opaque pixel to the right of the middle.
    rgba[(4 * 8 + 7) * 4..][..4].copy_from_slice(&[200, 100, 50, 255]);
    let turned = Placement {
        rotation_rad: std::f64::consts::FRAC_PI_2,
        ..place([20.0, 15.0])
    };
    let resampled = drawn(&rgba, (8, 8), &turned);
    assert_eq!(pixel(&resampled, 19, 18), [200, 100, 50, 255]);
}

/// Returns a white square of 6 x 6 pixels in a picture of 12 x 12.
fn square() -> Vec<u8> {
    let mut rgba = vec![0; 12 * 12 * 4];
    for k in 0..12 * 12 {
        let (x, y) = (k % 12, k / 12);
        if (3..9).contains(&x) && (3..9).contains(&y) {
            rgba[k * 4..][..4].copy_from_slice(&[255, 255, 255, 255]);
        }
    }
    rgba
}

#[test]
fn total_alpha_is_kept_at_any_position_rotation_and_scale() {
    for (center, rotation_rad, scale) in [
        ([20.5, 15.25], 0.0, 1.0),
        ([20.1, 15.7], 0.6, 1.0),
        ([20.1, 15.7], 0.6, 1.7),
        ([20.3, 15.1], 2.0, 0.7),
        ([20.3, 15.1], 0.3, 0.45),
        ([19.8, 15.4], 0.3, 0.3),
    ] {
        let turned = Placement {
            rotation_rad,
            scale,
            ..place(center)
        };
        let sum = alpha_sum(&drawn(&square(), (12, 12), &turned));
        let want = 36.0 * scale * scale;
        assert!(
            (sum - want).abs() < 0.05 * want + 0.5,
            "{scale}: {sum} {want}"
        );
    }
}

#[test]
fn no_edge_is_darker_than_its_sprite_at_any_scale() {
    for scale in [0.3, 0.45, 0.61, 0.8, 1.0, 1.3, 2.0] {
        let turned = Placement {
            rotation_rad: 0.37,
            scale,
            ..place([20.2, 14.9])
        };
        for pixel in drawn(&square(), (12, 12), &turned).pixels {
            let [r, g, b, a] = crate::raster::canvas::straight(pixel);
            // A fringe is a pixel with alpha whose color is darker than the white square.
            assert!(
                a < 3 || [r, g, b].iter().all(|&c| c >= 252),
                "{scale}: {pixel:?}"
            );
        }
    }
}

#[test]
fn fine_pattern_shrinks_to_an_even_gray() {
    let rgba: Vec<u8> = (0..32 * 32)
        .flat_map(|k| {
            [if (k % 32 + k / 32) % 2 == 0 { 230 } else { 30 }; 3]
                .into_iter()
                .chain([255])
        })
        .collect();
    let small = Placement {
        scale: 0.3,
        ..place([20.0, 15.0])
    };
    let resampled = drawn(&rgba, (32, 32), &small);
    for (x, y) in [(18, 14), (19, 15), (21, 16), (20, 13)] {
        assert!(pixel(&resampled, x, y)[0].abs_diff(130) < 12);
    }
}

#[test]
fn sprites_are_clipped_to_the_picture() {
    let rgba = checkered(6, 4);
    assert!(drawn(&rgba, (6, 4), &place([-30.0, 5.0])).rect.is_empty());
    let corner = drawn(&rgba, (6, 4), &place([0.0, 0.0]));
    assert_eq!((corner.rect.x, corner.rect.y), (0, 0));
}

#[test]
fn hidden_pixels_are_skipped_and_others_unchanged() {
    let turned = Placement {
        rotation_rad: 0.4,
        ..place([20.0, 14.0])
    };
    let mut canvas = Canvas::new(40, 30);
    for (k, pixel) in canvas.pixels.iter_mut().enumerate() {
        // Every second block is hidden; in the others only single pixels are.
        let hides = k / 8 % 2 == 1 || k % 3 == 2;
        pixel[3] = if hides { ONE } else { ONE - ONE / 256 };
    }
    let mut nearer = Coverage::new([40, 30]);
    let mut everywhere = Resampled {
        rect: Rect::of_size(40, 30),
        pixels: canvas.pixels.clone(),
        runs: Vec::new(),
    };
    everywhere.show_whole();
    Canvas::new(40, 30).draw_layer_under(&everywhere, &mut nearer, Level::Scalar);
    let sprite = Premultiplied::new(&square(), [12, 12], [6.0; 2], 1.0);
    for cpu in Level::available() {
        let (mut all, mut rest) = (Resampled::default(), Resampled::default());
        let size = [40, 30];
        let viewport = Viewport { size, nearer: None };
        all.draw(&sprite, &turned, viewport, cpu);
        let nearer = Some(&nearer);
        rest.draw(&sprite, &turned, Viewport { nearer, ..viewport }, cpu);
        assert_eq!(all.rect, rest.rect);
        let mut n_hidden = 0;
        let rect = all.rect;
        for (k, (all, rest)) in (0u32..).zip(all.pixels.iter().zip(&rest.pixels)) {
            let at = (rect.y + k / rect.w) * 40 + rect.x + k % rect.w;
            let is_hidden = at / 8 % 2 == 1;
            assert_eq!(*rest, if is_hidden { [0; 4] } else { *all });
            n_hidden += usize::from(is_hidden && all[3] > 0);
        }
        assert!(n_hidden > 5, "{n_hidden}");
    }
}

#[test]
fn every_instruction_set_gives_the_same_pixels() {
    for k in 0..24 {
        let turned = Placement {
            rotation_rad: 0.27 * f64::from(k),
            scale: 0.35 + 0.07 * f64::from(k),
            mirrored: k % 2 == 0,
            center_px: [20.0 + 0.13 * f64::from(k), 14.0],
        };
        let plain = drawn_with(&checkered(14, 9), (14, 9), &turned, Level::Scalar);
        for cpu in Level::available() {
            let other = drawn_with(&checkered(14, 9), (14, 9), &turned, cpu);
            assert_eq!(plain.pixels, other.pixels, "{}", cpu.name());
        }
    }
}

#[test]
fn visible_steps_span_the_first_to_the_last_visible_position() {
    // A bow shape: rows differ in start and end, and some are empty.
    let mut rgba = vec![0; 40 * 30 * 4];
    for k in 0..40 * 30 {
        let (x, y) = (k % 40, k / 40);
        let is_shown = !(12..15).contains(&y) && (x + y * y / 9) % 40 < 9;
        rgba[k * 4 + 3] = if is_shown { 200 } else { 0 };
    }
    let sprite = cut(&rgba, [40, 30], 1.0);
    let within =
        |at: [i32; 2]| (3..35).contains(&(at[0] >> 16)) && (3..30).contains(&(at[1] >> 16));
    let mut n_empty = 0;
    for k in 0..4000 {
        let random = |salt| (crate::random::bits(salt, &[k]) % (1 << 22)) as i32;
        let start = [random(1), random(2)].map(|at| at % (30 << 16) + (4 << 16));
        let step = [random(3), random(4) / 4].map(|step| (step - (1 << 20)) >> (k % 20));
        let step = step::Step::new(step);
        let n = (0..60)
            .take_while(|&k| within(step.position_after(start, k)))
            .count();
        let is_visible = |k: &usize| {
            let at = step.position_after(start, *k as i32);
            let [u, v] = at.map(|at| at + catmull_rom::HALF_PHASE);
            let [from, to] = sprite.spans[(v >> 16) as usize];
            from < u && u < to
        };
        let visible = sprite.visible_steps(start, &step, n);
        match (0..n).find(is_visible) {
            Some(first) => assert_eq!(
                Some(visible),
                (0..n).rfind(is_visible).map(|last| first..last + 1)
            ),
            None => assert!(visible.is_empty()),
        }
        n_empty += usize::from(n > 1 && (0..n).find(is_visible).is_none());
    }
    assert!(n_empty > 50, "{n_empty}");
}

#[test]
fn positions_beside_a_visible_pixel_are_drawn() {
    // An eighth of all pixels, many of them isolated.
    let mut rgba = checkered(14, 9);
    for (k, pixel) in rgba.chunks_exact_mut(4).enumerate() {
        pixel[3] = if k * 5 % 8 == 0 { 255 } else { 0 };
    }
    for k in 0..12 {
        let turned = Placement {
            rotation_rad: 0.5 * f64::from(k),
            scale: 0.7 + 0.2 * f64::from(k),
            ..place([20.0, 14.5])
        };
        let sprite = cut(&rgba, [14, 9], turned.scale);
        let map = Map::new(&sprite, &turned);
        let found = drawn(&rgba, (14, 9), &turned);
        let (alpha, rect, stride) = (found.alpha(), found.rect, sprite.stride());
        for (alpha, at) in alpha.into_iter().zip(0..) {
            let [x, y] = [rect.x + at % rect.w, rect.y + at / rect.w];
            let place = map.source(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let [u, v] = place.map(|at| at.floor() as usize);
            let beside = [0, 1, stride, stride + 1].map(|next| v * stride + u + next);
            let is_beside = u + 1 < stride
                && beside
                    .iter()
                    .any(|&at| sprite.pixels.get(at).is_some_and(|pixel| pixel[3] > 0));
            let mut whole = [[0; 4]];
            if is_beside {
                sprite.interpolate(&mut whole, place.map(fixed), [0, 0]);
            }
            // Positions are rounded to 1/256 of a pixel.
            assert!(
                alpha.abs_diff(whole[0][3] as u16) < 200,
                "{k} {x} {y}: {alpha}"
            );
        }
    }
}
