//! A matte composited over the background reproduces its frame (docs/explanation/algorithms.md, "Mattes").
//! In a film without noise, the mean absolute error in the animal's box is below 1.5 of 255 levels. The
//! matte's pixels are those of the frame, so nothing is interpolated.

use flockreel_core::footage::FrameSource;
use flockreel_core::library::{Library, Pose};
use flockreel_core::raster::{Frame, RgbImage};

use super::sample::filmed_without_noise;

#[test]
fn matte_over_the_background_reproduces_its_frame() {
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

/// Returns the mean absolute difference over the animal's box and the channels, levels of 255.
fn error_in_box(library: &Library, idx: usize, pose: &Pose, seen: &RgbImage) -> f64 {
    let (rect, centroid) = (pose.box_px.unwrap(), pose.centroid_px.unwrap());
    let (matte, mut rgba) = (library.sprites.matte(idx).unwrap(), Vec::new());
    library.sprites.read_matte(&matte, &mut rgba);
    let [left, top] = [0, 1].map(|k| (centroid[k] - matte.center_px[k]).round() as u32);
    let (mut sum, mut n) = (0.0, 0.0);
    for (k, rgba) in (0..).zip(rgba.chunks_exact(4)) {
        let (x, y) = (left + k % matte.size[0], top + k / matte.size[0]);
        if !rect.contains(x, y) {
            continue;
        }
        let (back, seen) = (library.background.pixel(x, y), seen.pixel(x, y));
        let alpha = f64::from(rgba[3]) / 255.0;
        for channel in 0..3 {
            let [fore, back] = [rgba[channel], back[channel]].map(f64::from);
            sum += (alpha * fore + (1.0 - alpha) * back - f64::from(seen[channel])).abs();
            n += 1.0;
        }
    }
    sum / n
}
