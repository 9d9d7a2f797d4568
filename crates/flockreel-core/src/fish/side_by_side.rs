//! The real animal and the virtual fish side by side (Nakajima et al., figures 2 and 3).
//!
//! The left half is the real frame, composed of matte and background. The right half is the virtual fish in
//! the same frame.

use super::film::Film;
use crate::library::Library;
use crate::raster::{Frame, RgbImage};

/// Draws frame `frame_idx` of both into one frame of twice the width. Panics beyond the last frame of
/// either, and if their sizes differ.
pub fn render(library: &Library, film: &Film, frame_idx: usize, frame: &mut Frame) {
    let real = real_frame(library, frame_idx);
    let mut virtual_frame = film.background().clone();
    film.draw(frame_idx).over(&mut virtual_frame);
    assert_eq!(real.size(), virtual_frame.size(), "sizes differ");
    let (width, height) = (2 * real.width, real.height);
    let mut both = RgbImage::new(width, height);
    let row_bytes = real.width as usize * 3;
    for (k, half_row) in both.pixels.chunks_exact_mut(row_bytes).enumerate() {
        let side = [&real, &virtual_frame][k % 2];
        half_row.copy_from_slice(&side.pixels[k / 2 * row_bytes..][..row_bytes]);
    }
    if (frame.width, frame.height) != (width, height) {
        *frame = Frame::new(width, height, frame.color);
    }
    frame.draw_all_rgb(&both);
}

/// Returns the background with the animal's matte of one frame at its place. If the animal was not found,
/// the background is returned.
fn real_frame(library: &Library, frame_idx: usize) -> RgbImage {
    let mut image = library.background.clone();
    let sprites = &library.sprites;
    let centroid = library.poses.frames[frame_idx].centroid_px;
    let Some(([cx, cy], matte)) = centroid.zip(sprites.matte(frame_idx)) else {
        return image;
    };
    let left = (cx - matte.center_px[0]).round() as i64;
    let top = (cy - matte.center_px[1]).round() as i64;
    let mut rgba = Vec::new();
    sprites.read_matte(&matte, &mut rgba);
    let rows = rgba.chunks_exact(matte.size[0].max(1) as usize * 4);
    for (y, row) in (top..).zip(rows) {
        for (x, rgba) in (left..).zip(row.chunks_exact(4)) {
            let inside = (0..i64::from(image.width)).contains(&x)
                && (0..i64::from(image.height)).contains(&y);
            if inside && rgba[3] > 0 {
                let under = image.pixel(x as u32, y as u32);
                let alpha = u32::from(rgba[3]);
                let over = |c: usize| {
                    (u32::from(rgba[c]) * alpha + u32::from(under[c]) * (255 - alpha) + 127) / 255
                };
                image.set_pixel(x as u32, y as u32, [0, 1, 2].map(|c| over(c) as u8));
            }
        }
    }
    image
}
