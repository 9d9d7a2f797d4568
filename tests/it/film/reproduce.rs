//! A sprite put back over the plate reproduces its frame (ALGORITHMS.md 2.7): mean absolute error in
//! the animal's box below 1.5 of 255, sensor noise around the animal included.
//!
//! Compared on the sprite's own pixels, which lie between those of the frame: frame and plate are
//! resampled to them as the sprite was, so that what is measured is the cutting out.

use flockreel::footage::FrameSource;
use flockreel::library::{Library, Pose};
use flockreel::raster::{Frame, RgbImage};

use super::sample::filmed;

#[test]
fn a_sprite_over_the_plate_reproduces_its_frame() {
    let (film, library, _) = filmed();
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
        let (back, seen) = (bilinear(&library.background, x, y), bilinear(seen, x, y));
        let alpha = f64::from(rgba[3]) / 255.0;
        for channel in 0..3 {
            let shown = alpha * f64::from(rgba[channel]) + (1.0 - alpha) * back[channel];
            sum += (shown - seen[channel]).abs();
            n += 1.0;
        }
    }
    sum / n
}

/// The color between four pixels; at the right and lower edge the last ones go on.
fn bilinear(image: &RgbImage, x: f64, y: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = |t: f64, d: u32| if d == 1 { t.fract() } else { 1.0 - t.fract() };
        let column = (x as u32 + dx).min(image.width - 1);
        let row = (y as u32 + dy).min(image.height - 1);
        for (sum, level) in sum.iter_mut().zip(image.pixel(column, row)) {
            *sum += weight(x, dx) * weight(y, dy) * f64::from(level);
        }
    }
    sum
}
