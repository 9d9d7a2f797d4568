//! Finds the second color of pixels that swaying scenery passes, such as a stalk in a current or a curtain
//! (docs/explanation/algorithms.md, "Light and noise").
//!
//! Such a pixel alternates between two colors, which no single noise value describes. Scenery only moves a
//! little, so its color occurs in the background nearby. The color of the animal does not, however long it
//! rests.

use rayon::prelude::*;

use crate::raster::{Frame, RgbImage};

/// Least difference from the background that shows another color, levels of 255. Free choice.
const CLEARLY: u8 = 12;
/// Least number of samples that must show the other color. Free choice.
const OFTEN: usize = 3;
/// Difference below which two values are equal, levels of 255. Free choice.
const SAME: u8 = 10;
/// Largest distance that scenery moves, as a share of the picture's width. Free choice.
const REACH: f64 = 1.0 / 40.0;

/// Returns the background in RGB with the second color at every pixel that scenery sways across. Returns
/// `None` if nothing sways. `free` returns the samples in which a pixel shows the scene, one bit each.
pub(super) fn other_color(
    samples: &[Frame],
    plate: &Frame,
    free: impl Fn(usize) -> u64 + Sync,
) -> Option<RgbImage> {
    let width = plate.width as usize;
    let rows: Vec<Vec<(usize, usize)>> = (0..plate.height as usize)
        .into_par_iter()
        .map(|y| {
            let counts = times_different(samples, plate, y);
            let places = (0..width).filter(|&x| usize::from(counts[x]) >= OFTEN);
            places
                .filter_map(|x| {
                    let px = y * width + x;
                    Some((px, sample_of_other(samples, plate, px, free(px))?))
                })
                .collect()
        })
        .collect();
    if rows.iter().all(Vec::is_empty) {
        return None;
    }
    let mut other = plate.clone();
    for &(px, sample) in rows.iter().flatten() {
        for at in places(plate, px) {
            other.planes[at] = samples[sample].planes[at];
        }
    }
    Some(other.to_rgb())
}

/// Returns whether the background shows a pixel's color within the distance that scenery moves.
pub(super) fn is_displaced(frame: &Frame, plate: &Frame, px: usize) -> bool {
    let color = places(frame, px).map(|at| frame.planes[at]);
    let (w, h) = (plate.width as usize, plate.height as usize);
    let reach = ((REACH * w as f64) as usize).max(4);
    let (x, y) = (px % w, px / w);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(h);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(w);
    rows.into_iter().any(|row| {
        columns.clone().any(|column| {
            plate.planes[row * w + column].abs_diff(color[0]) < SAME && {
                let there = places(plate, row * w + column);
                (1..3).all(|k| plate.planes[there[k]].abs_diff(color[k]) < SAME)
            }
        })
    })
}

/// Returns for each pixel of a row the number of samples that differ clearly in luma or chroma.
fn times_different(samples: &[Frame], plate: &Frame, y: usize) -> Vec<u8> {
    let width = plate.width as usize;
    let chroma_width = plate.chroma_width() as usize;
    let (n_luma, n_chroma) = (
        plate.luma().len(),
        (plate.planes.len() - plate.luma().len()) / 2,
    );
    let u = n_luma + y / 2 * chroma_width;
    let mut counts = vec![0u8; width];
    let mut chroma = vec![0u8; chroma_width];
    for sample in samples {
        let row = |start: usize, n: usize| {
            (
                &sample.planes[start..start + n],
                &plate.planes[start..start + n],
            )
        };
        let ((su, pu), (sv, pv)) = (row(u, chroma_width), row(u + n_chroma, chroma_width));
        for (k, flag) in chroma.iter_mut().enumerate() {
            *flag = u8::from(su[k].abs_diff(pu[k]).max(sv[k].abs_diff(pv[k])) >= CLEARLY);
        }
        let (sy, py) = row(y * width, width);
        for (x, count) in counts.iter_mut().enumerate() {
            *count += u8::from(sy[x].abs_diff(py[x]) >= CLEARLY) | chroma[x / 2];
        }
    }
    counts
}

/// Returns the free sample with the third largest difference among those that show a displaced color. The two
/// largest may be chance. Returns `None` if there are fewer.
fn sample_of_other(samples: &[Frame], plate: &Frame, px: usize, free: u64) -> Option<usize> {
    let at = places(plate, px);
    let gap = |k: usize| {
        let of = |at: usize| samples[k].planes[at].abs_diff(plate.planes[at]);
        of(at[0]).max(of(at[1])).max(of(at[2]))
    };
    let mut shown: Vec<(u8, usize)> = (0..samples.len())
        .filter(|k| free >> k & 1 == 1)
        .map(|k| (gap(k), k))
        .filter(|&(gap, k)| gap >= CLEARLY && is_displaced(&samples[k], plate, px))
        .collect();
    shown.sort_unstable_by(|a, b| b.cmp(a));
    shown.get(OFTEN - 1).map(|&(_, k)| k)
}

/// Returns the indices of a pixel's three values in the planes.
fn places(frame: &Frame, px: usize) -> [usize; 3] {
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
    fn where_a_stalk_sways_its_color_is_known_and_a_resting_animal_is_not_scenery() {
        let sways = |k: usize| if k.is_multiple_of(8) { 43 } else { 40 };
        let samples: Vec<Frame> = (0..32).map(|k| scene(sways(k), k % 4 == 1)).collect();
        let other = other_color(&samples, &scene(40, false), |_| u32::MAX.into());
        let other = other.expect("the stalk sways");
        let plate = scene(40, false).to_rgb();
        assert!(other.pixel(44, 10)[0] < plate.pixel(44, 10)[0] - 50);
        assert_eq!(other.pixel(95, 25), plate.pixel(95, 25));
        assert_eq!(other.pixel(20, 10), plate.pixel(20, 10));
    }

    #[test]
    fn where_nothing_sways_there_is_no_other_color() {
        let samples: Vec<Frame> = (0..32).map(|k| scene(40, k % 4 == 1)).collect();
        assert!(other_color(&samples, &scene(40, false), |_| u32::MAX.into()).is_none());
    }
}
