//! refused.jpg: evidence why a film could not be measured. It shows one frame with boxes around moving
//! objects, or the frames before and after a change side by side.

use super::overlay::{HEADING, outline, stroke, unit_px};
use super::picture;
use crate::geometry::Rect;
use crate::raster::resize::resized;
use crate::raster::{Frame, Pen, RgbImage};

/// Maximum side of each frame, pixels. Larger frames are reduced. Free choice.
const MAX_SIDE_PX: u32 = 640;
/// Gap between two frames, pixels.
const GAP_PX: u32 = 8;
/// Difference of luma above which a pixel counts as changed, levels of 255. Free choice.
const MIN_DIFFERENCE: u8 = 24;
/// Share of changed pixels above which they are not marked, because the marks would hide the frame. Free
/// choice.
const MAX_MARKED_SHARE: f64 = 0.5;

/// Draws the frames side by side as JPEG, with boxes over the last one. If there are two, changed pixels are
/// marked in the second. Panics if there is no frame, or if the frames differ in size.
pub fn draw(mut frames: Vec<Frame>, boxes_px: &[Rect]) -> Vec<u8> {
    let before = (frames.len() > 1).then(|| frames[0].clone());
    if let Some(last) = frames.last_mut() {
        let unit = unit_px(last.width, last.height);
        let mut pen = Pen::new(last.width, last.height);
        for rect in boxes_px {
            stroke(&mut pen, last, &outline(rect), 1.1 * unit, unit, HEADING);
        }
    }
    let mut pictures: Vec<RgbImage> = frames.iter().map(Frame::to_rgb).collect();
    if let (Some(before), Some(after), Some(picture)) = (before, frames.last(), pictures.last_mut())
    {
        mark_changes(&before, after, picture);
    }
    let small: Vec<RgbImage> = pictures.iter().map(reduced).collect();
    picture::write_jpeg(&side_by_side(&small))
}

/// Tints the pixels that differ between two frames.
fn mark_changes(before: &Frame, after: &Frame, picture: &mut RgbImage) {
    let pairs = before.luma().iter().zip(after.luma());
    let changed: Vec<bool> = pairs
        .map(|(a, b)| a.abs_diff(*b) > MIN_DIFFERENCE)
        .collect();
    let n_changed = changed.iter().filter(|changed| **changed).count();
    if n_changed as f64 > MAX_MARKED_SHARE * changed.len() as f64 {
        return;
    }
    let marked = picture.pixels.chunks_exact_mut(3).zip(changed);
    for (rgb, _) in marked.filter(|(_, changed)| *changed) {
        for (value, tint) in rgb.iter_mut().zip(HEADING) {
            *value = value.midpoint(tint);
        }
    }
}

/// Returns a frame as JPEG, reduced so that no side is longer than 640 pixels. Panics if it has no pixels.
pub fn small_jpeg(frame: &Frame) -> Vec<u8> {
    picture::write_jpeg(&reduced(&frame.to_rgb()))
}

/// Returns the picture, reduced so that no side is longer than [`MAX_SIDE_PX`].
fn reduced(picture: &RgbImage) -> RgbImage {
    let [width, height] = [picture.width, picture.height].map(f64::from);
    let scale = (f64::from(MAX_SIDE_PX) / width.max(height)).min(1.0);
    let [width, height] = [width, height].map(|side| ((side * scale).round() as u32).max(1));
    resized(picture, width, height)
}

/// Returns pictures of one size in a row, on white.
fn side_by_side(pictures: &[RgbImage]) -> RgbImage {
    let (n, step) = (pictures.len() as u32, pictures[0].width + GAP_PX);
    let mut row = RgbImage::new(n * step - GAP_PX, pictures[0].height);
    row.pixels.fill(255);
    let row_bytes = row.width as usize * 3;
    for (at, picture) in pictures.iter().enumerate() {
        let left = at * step as usize * 3;
        let lines = picture.pixels.chunks_exact(picture.width as usize * 3);
        for (line, into) in lines.zip(row.pixels.chunks_exact_mut(row_bytes)) {
            into[left..left + line.len()].copy_from_slice(line);
        }
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    fn gray(width: u32, height: u32) -> Frame {
        let mut frame = Frame::new(width, height, ColorSpec::default());
        frame.planes.fill(128);
        frame
    }

    fn decoded(jpeg: &[u8]) -> image::RgbImage {
        image::load_from_memory(jpeg)
            .expect("our own JPEG")
            .into_rgb8()
    }

    fn is_orange([r, _, b]: [u8; 3]) -> bool {
        r > b.saturating_add(60)
    }

    #[test]
    fn single_frame_has_its_boxes_and_is_reduced() {
        let rect = Rect {
            x: 200,
            y: 100,
            w: 400,
            h: 200,
        };
        let picture = decoded(&draw(vec![gray(1280, 720)], &[rect]));
        assert_eq!(picture.dimensions(), (640, 360));
        assert!(is_orange(picture.get_pixel(100, 100).0));
        assert!(!is_orange(picture.get_pixel(200, 100).0));
    }

    #[test]
    fn two_frames_are_side_by_side_with_changes_marked() {
        let mut after = gray(64, 48);
        for y in 8..24 {
            after.planes[y * 64 + 16..y * 64 + 32].fill(200);
        }
        let picture = decoded(&draw(vec![gray(64, 48), after], &[]));
        assert_eq!(picture.dimensions(), (64 + 8 + 64, 48));
        assert!(is_orange(picture.get_pixel(72 + 24, 16).0));
        assert!(!is_orange(picture.get_pixel(24, 16).0));
        assert!(!is_orange(picture.get_pixel(72 + 50, 16).0));
    }

    #[test]
    fn changes_of_most_pixels_are_not_marked() {
        let mut after = gray(64, 48);
        after.planes[..64 * 48].fill(220);
        let picture = decoded(&draw(vec![gray(64, 48), after], &[]));
        assert!(!is_orange(picture.get_pixel(72 + 24, 16).0));
    }
}
