//! Scenery that moves a little: a stalk in the current, a curtain (ALGORITHMS.md 2.4).
//!
//! A pixel that it passes shows two colors by turns, and no single noise describes that. The second color
//! is known by where else it is: what sways only moves, so its color is found in the plate a little to the
//! side. The animal's is not, however long it stays.

use rayon::prelude::*;

use crate::raster::{Frame, RgbImage};

/// Levels by which a sample must differ from the plate to show another color.
const CLEARLY: u8 = 12;
/// So many free samples must show it.
const OFTEN: usize = 3;
/// Levels within which a color is the same.
const SAME: u8 = 10;
/// How far scenery moves: this share of the picture's width, pixels.
const REACH: f64 = 1.0 / 40.0;

/// The plate with, at every pixel that something sways across, the other color seen there; `None` where
/// nothing sways. `free` tells in which samples, as bits, a pixel shows the scene.
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

/// Whether a pixel of a frame shows something that the plate has a little to the side.
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

/// In how many samples each pixel of a row differs clearly in luma or chroma.
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

/// The free sample that shows the other color most clearly but for two: those may be chance.
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

/// Where the three values of a pixel lie in the planes.
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

    /// A dark stalk three pixels wide on a bright wall, at a column; and a bright square that rests.
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
