//! Likeness of the virtual animal to the filmed one: how far the drawn silhouette and colors agree with the
//! mattes, frame by frame.

use rayon::prelude::*;

use super::figure::Pixels;
use super::film::Film;
use crate::library::Library;
use crate::order::median;

/// Agreement of the virtual animal with the filmed one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// Number of frames that were compared: those that show the whole animal.
    pub n_frames: usize,
    /// Median over the frames of the intersection of both silhouettes divided by their union, 0..=1.
    pub overlap: f64,
    /// Median over the frames of the mean absolute difference of color inside both, levels of 255.
    pub color_levels: f64,
}

/// Largest number of frames that are compared. Free choice; more change the medians little.
const MOST_FRAMES: usize = 300;

/// Returns the likeness over the frames that show the whole animal, evenly chosen from a long film; `None` if
/// there are none.
pub fn likeness(library: &Library, film: &Film) -> Option<Likeness> {
    let n_frames = library.poses.frames.len();
    let step = n_frames.div_ceil(MOST_FRAMES).max(1);
    let is_whole = |k: &usize| {
        let pose = &library.poses.frames[*k];
        pose.detected() && !pose.cut
    };
    let frames: Vec<usize> = (0..n_frames).step_by(step).filter(is_whole).collect();
    let each: Vec<[f64; 2]> = frames
        .into_par_iter()
        .filter_map(|k| Some(compare(&Pixels::read(library, k)?, film, k)))
        .collect();
    Some(Likeness {
        n_frames: each.len(),
        overlap: median(each.iter().map(|frame| frame[0]))?,
        color_levels: median(each.iter().map(|frame| frame[1]))?,
    })
}

/// Returns overlap and color difference of one frame.
fn compare(filmed: &Pixels, film: &Film, frame_idx: usize) -> [f64; 2] {
    let drawing = film.draw(frame_idx);
    let rect = drawing.rect;
    let (mut both, mut drawn, mut difference) = (0.0, 0.0, 0.0);
    for y in 0..rect.h {
        for x in 0..rect.w {
            let [r, g, b, a] = drawing.pixels[(y * rect.w + x) as usize];
            if a < 0.5 {
                continue;
            }
            drawn += 1.0;
            let seen = filmed.pixel(i64::from(rect.x + x), i64::from(rect.y + y));
            if seen[3] >= 128 {
                both += 1.0;
                let gap = |(drawn, seen): (f32, u8)| (drawn / a * 255.0 - f32::from(seen)).abs();
                let gaps = [r, g, b].into_iter().zip(seen).map(gap);
                difference += f64::from(gaps.sum::<f32>()) / 3.0;
            }
        }
    }
    let either = drawn + filmed.n_covered() as f64 - both;
    [
        both / f64::max(either, 1.0),
        difference / f64::max(both, 1.0),
    ]
}
