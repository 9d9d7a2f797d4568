//! Finds occluders in front of the animal (cage wires, scratches on a pane) and removes them from the mattes.
//! They are returned as an image, to be drawn in front of the animals of a flock.
//!
//! An occluder of color F and share w turns a scene S into the background B = w F + (1 - w) S. With an animal
//! of color A behind it, the frame shows I = w F + (1 - w) A. Hence I - B = (1 - w)(A - S). A - S is measured
//! as the mean of I - B over a ring of unoccluded pixels around. The least-squares share over all frames is
//! w = 1 - sum (I - B)(A - S) / sum (A - S)^2.
//!
//! A marking of the coat may look like an occluder for a while. So seed pixels need a line in the background,
//! with a contrast opposite to the animal's. Weaker pixels count only when connected to a seed. Not found:
//! occluders of the background's color, broad ones, and those that cut the silhouette in two.

mod evidence;
mod mend;
mod ring;

use std::collections::HashMap;

use self::evidence::{Criteria, Evidence, EvidenceInput};
use self::ring::SummedArea;
use super::Error;
use super::scene::background::Background;
use super::track::sighting::Sighting;
use super::track::{Track, Tracked};
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::runs::{Component, components};
use crate::raster::{Mask, RgbImage, RgbaImage};

/// Least deviation of a line in the background from both of its sides, levels of 255. Free choice.
const MIN_LINE_CONTRAST: i32 = 20;
/// Offsets to one side of a line in four directions, pixels; the other side is opposite.
const ACROSS: [[i32; 2]; 4] = [[3, 0], [0, 3], [3, 3], [3, -3]];
/// Conditions for a seed pixel. Free choice.
const SEED: Criteria = Criteria {
    share: 0.2,
    needs_line: true,
    unexplained: 0.25,
    gain: 100.0,
    gain_of_all: 1600.0,
};
/// Conditions for a pixel connected to a seed: duller parts of a wire and its blurred rim. Free choice.
const CONNECTED: Criteria = Criteria {
    share: 0.08,
    needs_line: false,
    unexplained: 0.4,
    gain: 16.0,
    gain_of_all: 0.0,
};
/// Least area of a connected group of seed pixels; smaller groups are chance. Free choice.
const MIN_AREA_PX: u64 = 3;
/// Least distance of the centroid between two frames that are used, pixels. A resting animal adds no
/// evidence.
const MIN_DISTANCE_PX: f64 = 3.0;
/// Greatest number of frames per square of side [`MIN_DISTANCE_PX`]: a rocking animal repeats two pictures.
const MAX_AT_PLACE: u32 = 3;
/// Greatest number of frames used. Free choice: it bounds the time.
const MAX_FRAMES: usize = 1024;

/// Finds occluders in front of the main background, removes them from the track's mattes, and measures those
/// again.
///
/// Returns an image of the footage's size with the straight color F and alpha w, or `None` without occluders.
/// Fails with `Cancelled` when `progress` says so, and when the scratch is full.
pub fn remove(
    track: &mut Track,
    background: &Background,
    progress: &dyn Progress,
) -> Result<Option<RgbaImage>, Error> {
    let sightings = spaced_sightings(track);
    let boxes = sightings.iter().map(|seen| seen.rect);
    let within = boxes.reduce(|all, one| all.union(&one)).unwrap_or_default();
    let lines = lines(&background.rgb, within);
    if lines.area() == 0 {
        return Ok(None);
    }
    let find = |found: &Mask| {
        let input = EvidenceInput {
            background: &background.rgb,
            found,
        };
        let evidence = input.collect(track, &sightings, progress)?;
        Ok::<_, Error>((occluded(&evidence, &lines), evidence))
    };
    let (found, _) = find(&Mask::new(within))?;
    if found.area() == 0 {
        return Ok(None);
    }
    // The second pass leaves the found pixels out of the rings, which makes their means more accurate.
    let (found, evidence) = find(&found)?;
    if found.area() == 0 {
        return Ok(None);
    }
    let occluders = picture(&background.rgb, &found, &evidence);
    mend::mend_mattes(track, &occluders, progress)?;
    Ok(Some(occluders))
}

/// Returns the sightings to use: the animal moves between them, and few lie at one place.
fn spaced_sightings(track: &Track) -> Vec<Sighting> {
    let (mut spaced_sightings, mut last) = (Vec::new(), None);
    let mut n_at: HashMap<[i64; 2], u32> = HashMap::new();
    for seen in track
        .frames
        .iter()
        .filter_map(Tracked::before_main_background)
    {
        let [x, y] = seen.moments.centroid_px;
        let is_apart = |[u, v]: [f64; 2]| libm::hypot(x - u, y - v) >= MIN_DISTANCE_PX;
        if !last.is_none_or(is_apart) {
            continue;
        }
        let n_here = n_at
            .entry([x, y].map(|px| (px / MIN_DISTANCE_PX).floor() as i64))
            .or_default();
        *n_here += 1;
        if *n_here <= MAX_AT_PLACE {
            last = Some([x, y]);
            spaced_sightings.push(seen.clone());
        }
    }
    let step = spaced_sightings.len().div_ceil(MAX_FRAMES).max(1);
    spaced_sightings.into_iter().step_by(step).collect()
}

/// Returns the pixels in a box that are brighter, or darker, than the background on both sides of them.
fn lines(background: &RgbImage, within: Rect) -> Mask {
    let mut lines = Mask::new(within);
    let columns = within.w as usize;
    let beyond = |at: u32, step: i32, size: u32| at.saturating_add_signed(step).min(size - 1);
    for (k, bit) in lines.bits.iter_mut().enumerate() {
        let (x, y) = (
            within.x + (k % columns) as u32,
            within.y + (k / columns) as u32,
        );
        let here = background.pixel(x, y);
        let beside = |dx: i32, dy: i32| {
            let (x, y) = (
                beyond(x, dx, background.width),
                beyond(y, dy, background.height),
            );
            background.pixel(x, y)
        };
        let is_line = ACROSS.iter().any(|&[dx, dy]| {
            let sides = [beside(dx, dy), beside(-dx, -dy)];
            (0..3).any(|c| {
                let off = sides.map(|side| i32::from(here[c]) - i32::from(side[c]));
                off.iter().all(|&off| off >= MIN_LINE_CONTRAST)
                    || off.iter().all(|&off| off <= -MIN_LINE_CONTRAST)
            })
        });
        *bit = u8::from(is_line);
    }
    lines
}

/// Returns the color of pixel `k` of a box of an image.
fn color_at(picture: &RgbImage, rect: Rect, k: usize) -> [u8; 3] {
    let columns = rect.w as usize;
    let (x, y) = ((k % columns) as u32, (k / columns) as u32);
    picture.pixel(rect.x + x, rect.y + y)
}

/// Returns the occluded pixels: groups of connected `CONNECTED` pixels that contain a group of seeds.
fn occluded(evidence: &[(usize, Evidence)], lines: &Mask) -> Mask {
    let (mut seeds_mask, mut connected) = (Mask::new(lines.rect), Mask::new(lines.rect));
    for (k, evidence) in evidence {
        seeds_mask.bits[*k] = lines.bits[*k] & u8::from(evidence.meets(&SEED));
        connected.bits[*k] = seeds_mask.bits[*k] | u8::from(evidence.meets(&CONNECTED));
    }
    let seeds: Vec<Component> = (components(&seeds_mask).into_iter())
        .filter(|component| component.area >= MIN_AREA_PX)
        .collect();
    let mut seeded = Mask::new(lines.rect);
    for seed in &seeds {
        seeded.add(&seed.mask(seed.rect));
    }
    let mut found = Mask::new(lines.rect);
    for component in components(&connected) {
        let mut pixels = component
            .runs
            .iter()
            .flat_map(|run| (run.x0..run.x1).map(|x| (x, run.y)));
        if pixels.any(|(x, y)| seeded.is_set(x, y)) {
            found.add(&component.mask(component.rect));
        }
    }
    found
}

/// Returns the occluder image: color F = (B - (1 - w) S) / w, with S the background's ring mean, and alpha w.
fn picture(background: &RgbImage, found: &Mask, evidence: &[(usize, Evidence)]) -> RgbaImage {
    let within = found.rect;
    let known = |k: usize| i32::from(found.bits[k] == 0);
    let n = SummedArea::new(within, known);
    let of_channel = |c: usize| {
        SummedArea::new(within, |k| {
            known(k) * i32::from(color_at(background, within, k)[c])
        })
    };
    let sums = [0, 1, 2].map(of_channel);
    let mut picture = RgbaImage::new(background.width, background.height);
    for (k, evidence) in evidence.iter().filter(|(k, _)| found.bits[*k] == 1) {
        let (x, y) = (k % within.w as usize, k / within.w as usize);
        let n = n.ring(x, y);
        let (share, shown) = (
            evidence.share(),
            color_at(background, within, *k).map(f64::from),
        );
        let own = |c: usize| {
            let scene = match n {
                0 => shown[c],
                n => f64::from(sums[c].ring(x, y)) / f64::from(n),
            };
            ((shown[c] - (1.0 - share) * scene) / share).round() as u8
        };
        let rgba = [own(0), own(1), own(2), (255.0 * share).round() as u8];
        picture.set_pixel(within.x + x as u32, within.y + y as u32, rgba);
    }
    picture
}

#[cfg(test)]
mod tests;
