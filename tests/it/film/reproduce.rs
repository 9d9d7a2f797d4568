//! A sprite put back over the plate reproduces its frame (ALGORITHMS.md 2.7): mean absolute error in
//! the animal's box below 1.5 of 255, in a film without noise.
//!
//! Compared on the sprite's own pixels, which lie between those of the frame: frame and plate are
//! resampled to them as the sprite was, so that what is measured is the cutting out.

use flockreel::footage::FrameSource;
use flockreel::library::{Library, Pose};
use flockreel::raster::{Frame, RgbImage};

use super::sample::filmed_without_noise;

#[test]
fn a_sprite_over_the_plate_reproduces_its_frame() {
    let (film, library, _) = filmed_without_noise();
    let (mut stream, mut frame) = (film.open().unwrap(), Frame::default());
    let mut n_frames = 0;
    for (idx, pose) in library.poses.frames.iter().enumerate() {
        let time_s = stream.next_frame(&mut frame).unwrap();
        assert!(time_s.is_some(), "a frame for every pose");
        if library.sprites.is_present(idx) && !pose.cut {
            let error = error_in_box(library, idx, pose, &frame.to_rgb());
            assert!(error < 1.5, "frame {idx}: {error}");
            n_frames += 1;
        }
    }
    assert!(n_frames > 150, "{n_frames}");
}

/// Mean absolute difference over the box and the channels.
fn error_in_box(library: &Library, idx: usize, pose: &Pose, seen: &RgbImage) -> f64 {
    let (rect, centroid) = (pose.box_px.unwrap(), pose.centroid_px.unwrap());
    let (width, height) = (library.sprites.width(), library.sprites.height());
    let (mut sum, mut n) = (0.0, 0.0);
    for (k, rgba) in library.sprites.sprite(idx).chunks_exact(4).enumerate() {
        let (column, row) = (k as u32 % width, k as u32 / width);
        // The sprite's centroid lies at its middle.
        let x = f64::from(column) + centroid[0] - f64::from(width) / 2.0;
        let y = f64::from(row) + centroid[1] - f64::from(height) / 2.0;
        if x < 0.0 || y < 0.0 || !rect.contains(x as u32, y as u32) {
            continue;
        }
        let (back, seen) = (between(&library.background, x, y), between(seen, x, y));
        let alpha = f64::from(rgba[3]) / 255.0;
        for channel in 0..3 {
            let shown = alpha * f64::from(rgba[channel]) + (1.0 - alpha) * back[channel];
            sum += (shown - seen[channel]).abs();
            n += 1.0;
        }
    }
    sum / n
}

/// The color between pixels by Catmull and Rom's curve, as sprites are cut; at the edges the last ones go on.
fn between(image: &RgbImage, x: f64, y: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (dy, down) in (-1i64..).zip(weights(y - y.floor())) {
        for (dx, across) in (-1i64..).zip(weights(x - x.floor())) {
            let near = |at: f64, d: i64, n: u32| (at.floor() as i64 + d).clamp(0, i64::from(n) - 1);
            let (column, row) = (near(x, dx, image.width), near(y, dy, image.height));
            for (sum, level) in sum.iter_mut().zip(image.pixel(column as u32, row as u32)) {
                *sum += across * down * f64::from(level);
            }
        }
    }
    sum
}

fn weights(f: f64) -> [f64; 4] {
    let (f2, f3) = (f * f, f * f * f);
    [
        -0.5 * f + f2 - 0.5 * f3,
        1.0 - 2.5 * f2 + 1.5 * f3,
        0.5 * f + 2.0 * f2 - 1.5 * f3,
        0.5 * (f3 - f2),
    ]
}
