//! Finds the second color of pixels that swaying scenery passes, such as a stalk in a current or a curtain
//! (docs/explanation/algorithms.md, "Light and noise").
//!
//! Such a pixel alternates between two colors, which no single noise value describes. Scenery only moves a
//! little, so its color occurs in the background nearby. The color of the animal does not, however long it
//! rests.

use rayon::prelude::*;

use crate::raster::{Frame, RgbImage};

/// Least difference from the background that shows another color, levels of 255. Free choice.
const MIN_DIFFERENCE: u8 = 12;
/// Least number of samples that must show the other color. Free choice.
const MIN_SAMPLES: usize = 3;
/// Difference below which two values are equal, levels of 255. Free choice.
const SAME_LEVELS: u8 = 10;
/// Largest distance that scenery moves, as a share of the picture's width. Free choice.
const MAX_DISTANCE: f64 = 1.0 / 40.0;

/// Returns the background in RGB with the second color at every pixel that scenery sways across. Returns
/// `None` if nothing sways. `free` returns the samples in which a pixel shows the scene, one bit each.
pub(super) fn other_color(
    samples: &[Frame],
    background: &Frame,
    free: impl Fn(usize) -> u64 + Sync,
) -> Option<RgbImage> {
    let width = background.width as usize;
    let rows: Vec<Vec<(usize, usize)>> = (0..background.height as usize)
        .into_par_iter()
        .map(|y| {
            let counts = times_different(samples, background, y);
            let columns = (0..width).filter(|&x| usize::from(counts[x]) >= MIN_SAMPLES);
            columns
                .filter_map(|x| {
                    let px = y * width + x;
                    Some((
                        px,
                        sample_of_other_color(samples, background, px, free(px))?,
                    ))
                })
                .collect()
        })
        .collect();
    if rows.iter().all(Vec::is_empty) {
        return None;
    }
    let mut other = background.clone();
    for &(px, sample) in rows.iter().flatten() {
        for at in value_indices(background, px) {
            other.planes[at] = samples[sample].planes[at];
        }
    }
    Some(other.to_rgb())
}

/// Returns whether the background shows a pixel's color within the distance that scenery moves.
pub(super) fn occurs_nearby(frame: &Frame, background: &Frame, px: usize) -> bool {
    let color = value_indices(frame, px).map(|at| frame.planes[at]);
    let (w, h) = (background.width as usize, background.height as usize);
    let reach = ((MAX_DISTANCE * w as f64) as usize).max(4);
    let (x, y) = (px % w, px / w);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(h);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(w);
    rows.into_iter().any(|row| {
        columns.clone().any(|column| {
            background.planes[row * w + column].abs_diff(color[0]) < SAME_LEVELS && {
                let there = value_indices(background, row * w + column);
                (1..3).all(|k| background.planes[there[k]].abs_diff(color[k]) < SAME_LEVELS)
            }
        })
    })
}

/// Returns for each pixel of a row the number of samples that differ clearly in luma or chroma.
fn times_different(samples: &[Frame], background: &Frame, y: usize) -> Vec<u8> {
    let width = background.width as usize;
    let chroma_width = background.chroma_width() as usize;
    let (n_luma, n_chroma) = (
        background.luma().len(),
        (background.planes.len() - background.luma().len()) / 2,
    );
    let u = n_luma + y / 2 * chroma_width;
    let mut counts = vec![0u8; width];
    let mut chroma = vec![0u8; chroma_width];
    for sample in samples {
        let row = |start: usize, n: usize| {
            (
                &sample.planes[start..start + n],
                &background.planes[start..start + n],
            )
        };
        let ((su, pu), (sv, pv)) = (row(u, chroma_width), row(u + n_chroma, chroma_width));
        for (k, flag) in chroma.iter_mut().enumerate() {
            *flag = u8::from(su[k].abs_diff(pu[k]).max(sv[k].abs_diff(pv[k])) >= MIN_DIFFERENCE);
        }
        let (sy, py) = row(y * width, width);
        for (x, count) in counts.iter_mut().enumerate() {
            *count += u8::from(sy[x].abs_diff(py[x]) >= MIN_DIFFERENCE) | chroma[x / 2];
        }
    }
    counts
}

/// Returns the free sample with the third largest difference among those that show a displaced color. The two
/// largest may be chance. Returns `None` if there are fewer.
fn sample_of_other_color(
    samples: &[Frame],
    background: &Frame,
    px: usize,
    free: u64,
) -> Option<usize> {
    let at = value_indices(background, px);
    let gap = |k: usize| {
        let difference = |at: usize| samples[k].planes[at].abs_diff(background.planes[at]);
        difference(at[0])
            .max(difference(at[1]))
            .max(difference(at[2]))
    };
    let mut shown: Vec<(u8, usize)> = (0..samples.len())
        .filter(|k| free >> k & 1 == 1)
        .map(|k| (gap(k), k))
        .filter(|&(gap, k)| gap >= MIN_DIFFERENCE && occurs_nearby(&samples[k], background, px))
        .collect();
    shown.sort_unstable_by(|a, b| b.cmp(a));
    shown.get(MIN_SAMPLES - 1).map(|&(_, k)| k)
}

/// Returns the indices of a pixel's three values in the planes.
fn value_indices(frame: &Frame, px: usize) -> [usize; 3] {
    let (width, n_luma) = (frame.width as usize, frame.luma().len());
    let chroma = px / width / 2 * frame.chroma_width() as usize + px % width / 2;
    let n_chroma = (frame.planes.len() - n_luma) / 2;
    [px, n_luma + chroma, n_luma + n_chroma + chroma]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::ColorSpec;

    /// Returns a dark stalk three pixels wide at column `stalk_x` of a bright wall, optionally with a resting
    /// bright square.
    fn scene(stalk_x: usize, animal: bool) -> Frame {
        let mut frame = Frame::new(128, 64, ColorSpec::default());
        frame.planes.fill(128);
        for y in 0..64 {
            for x in 0..128 {
                let value = match (x, y) {
                    _ if animal && (90..100).contains(&x) && (20..30).contains(&y) => 230,
                    _ if (stalk_x..stalk_x + 3).contains(&x) => 60,
                    _ => 150,
                };
                frame.planes[y * 128 + x] = value;
            }
        }
        frame
    }

    #[test]
    fn swaying_stalk_gives_a_second_color_and_resting_animal_does_not() {
        let sways = |k: usize| if k.is_multiple_of(8) { 43 } else { 40 };
        let samples: Vec<Frame> = (0..32).map(|k| scene(sways(k), k % 4 == 1)).collect();
        let other = other_color(&samples, &scene(40, false), |_| u32::MAX.into());
        let other = other.expect("the stalk sways");
        let background = scene(40, false).to_rgb();
        assert!(other.pixel(44, 10)[0] < background.pixel(44, 10)[0] - 50);
        assert_eq!(other.pixel(95, 25), background.pixel(95, 25));
        assert_eq!(other.pixel(20, 10), background.pixel(20, 10));
    }

    #[test]
    fn still_scene_has_no_second_color() {
        let samples: Vec<Frame> = (0..32).map(|k| scene(40, k % 4 == 1)).collect();
        assert!(other_color(&samples, &scene(40, false), |_| u32::MAX.into()).is_none());
    }
}
