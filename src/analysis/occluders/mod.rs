//! What stands before the animal (the wires of a cage, a scratch of the pane) is found, taken out of the mattes, and kept
//! to be drawn before whoever passes behind it. Without this the wires fly with the bird.
//!
//! Where an occluder of color F takes the share w of a pixel before a scene S, the plate shows B = w F + (1 - w) S, and a
//! frame whose animal of color A is behind it I = w F + (1 - w) A. So I - B = (1 - w)(A - S): there the frame differs less
//! from the plate than around. A - S is the mean of I - B over a ring of pixels that show the animal and nothing before it;
//! over all frames the best w is 1 - sum (I - B)(A - S) / sum (A - S)^2.
//!
//! A marking of the coat may look like that for a while, so it is certain only where the plate has a line or a speck too, and
//! only when that is bright and the animal darker than the scene, or the other way about: through an animal that lets
//! light through, a dark line behind it looks as one before a dark animal would. From there it is followed to where
//! less is enough. What has the color of the scene behind it all along, or is broader than a few pixels, is not found;
//! what hides the animal wholly across its whole breadth tears the silhouette, of which one part alone is followed.

mod evidence;
mod mend;
mod ring;

use std::collections::HashMap;

use self::evidence::{Evidence, Proof, Question};
use self::ring::SummedArea;
use super::Error;
use super::scene::plate::Plate;
use super::track::sighting::Sighting;
use super::track::{Track, Tracked};
use crate::geometry::Rect;
use crate::progress::Progress;
use crate::raster::runs::{Component, components};
use crate::raster::{Mask, RgbImage, RgbaImage};

/// Where something may be before the animal the plate is off by at least so many levels ...
const STARK: i32 = 20;
/// ... from what lies on both sides.
const ACROSS: [[i32; 2]; 4] = [[3, 0], [0, 3], [3, 3], [3, -3]];
/// What is certain of a pixel by itself.
const CERTAIN: Proof = Proof {
    share: 0.2,
    is_in_plate: true,
    unexplained: 0.25,
    gain: 100.0,
    gain_of_all: 1600.0,
};
/// What is enough of one that is joined to such: where the same wire is duller, and its blurred rim.
const ENOUGH: Proof = Proof {
    share: 0.08,
    is_in_plate: false,
    unexplained: 0.4,
    gain: 16.0,
    gain_of_all: 0.0,
};
/// Fewer certain pixels that touch are chance.
const LEAST_AREA_PX: u64 = 3;
/// Between two frames that are looked at the animal has moved by so many pixels: what rests shows the same again.
const APART_PX: f64 = 3.0;
/// And at a place of that size it is looked at so often at most: who rocks to and fro shows two pictures, not many.
const MOST_AT_PLACE: u32 = 3;
/// More frames than these tell nothing new.
const MOST_FRAMES: usize = 1024;

/// Finds what stands before the animal and the main plate, and takes it out of the track's mattes, which are measured anew.
/// The picture is of the footage's size: straight color F and alpha w; `None` when nothing was found.
pub fn take_out(
    track: &mut Track,
    plate: &Plate,
    progress: &dyn Progress,
) -> Result<Option<RgbaImage>, Error> {
    let sightings = spaced(track);
    let within = (sightings.iter()).fold(Rect::default(), |all, seen| match all.is_empty() {
        true => seen.rect,
        false => all.union(&seen.rect),
    });
    let stark = stark(&plate.rgb, within);
    if stark.area() == 0 {
        return Ok(None);
    }
    let judge = |found: &Mask| {
        let question = Question {
            plate: &plate.rgb,
            found,
        };
        let evidence = question.answer(track, &sightings, progress)?;
        Ok::<_, Error>((judged(&evidence, &stark), evidence))
    };
    let (found, _) = judge(&Mask::new(within))?;
    if found.area() == 0 {
        return Ok(None);
    }
    // What was found is left out of rings now, so that they show the animal more truly.
    let (found, evidence) = judge(&found)?;
    if found.area() == 0 {
        return Ok(None);
    }
    let occluders = picture(&plate.rgb, &found, &evidence);
    mend::mend(track, &occluders, progress)?;
    Ok(Some(occluders))
}

/// Sightings between which the animal moved, few of them at one place.
fn spaced(track: &Track) -> Vec<Sighting> {
    let (mut spaced, mut last) = (Vec::new(), None);
    let mut n_at: HashMap<[i64; 2], u32> = HashMap::new();
    for seen in track.frames.iter().filter_map(Tracked::before_main_plate) {
        let [x, y] = seen.moments.centroid_px;
        let is_apart = |[u, v]: [f64; 2]| libm::hypot(x - u, y - v) >= APART_PX;
        if !last.is_none_or(is_apart) {
            continue;
        }
        let n_here = n_at
            .entry([x, y].map(|px| (px / APART_PX).floor() as i64))
            .or_default();
        *n_here += 1;
        if *n_here <= MOST_AT_PLACE {
            last = Some([x, y]);
            spaced.push(seen.clone());
        }
    }
    let step = spaced.len().div_ceil(MOST_FRAMES).max(1);
    spaced.into_iter().step_by(step).collect()
}

/// The pixels of the plate within a box that stand out, in some direction, from what is on both sides.
fn stark(plate: &RgbImage, within: Rect) -> Mask {
    let mut stark = Mask::new(within);
    let columns = within.w as usize;
    let beyond = |at: u32, step: i32, size: u32| at.saturating_add_signed(step).min(size - 1);
    for (k, bit) in stark.bits.iter_mut().enumerate() {
        let (x, y) = (
            within.x + (k % columns) as u32,
            within.y + (k / columns) as u32,
        );
        let here = plate.pixel(x, y);
        let beside = |dx: i32, dy: i32| {
            let (x, y) = (beyond(x, dx, plate.width), beyond(y, dy, plate.height));
            plate.pixel(x, y)
        };
        let is_line = ACROSS.iter().any(|&[dx, dy]| {
            let sides = [beside(dx, dy), beside(-dx, -dy)];
            (0..3).any(|c| {
                let off = sides.map(|side| i32::from(here[c]) - i32::from(side[c]));
                off.iter().all(|&off| off >= STARK) || off.iter().all(|&off| off <= -STARK)
            })
        });
        *bit = u8::from(is_line);
    }
    stark
}

/// The color of pixel `k` of a box of a picture.
fn color_at(picture: &RgbImage, rect: Rect, k: usize) -> [u8; 3] {
    let columns = rect.w as usize;
    let (x, y) = ((k % columns) as u32, (k / columns) as u32);
    picture.pixel(rect.x + x, rect.y + y)
}

/// Where something is before the animal: what is certain, where enough of it touches, and all that is joined to it.
fn judged(evidence: &[(usize, Evidence)], stark: &Mask) -> Mask {
    let (mut certain, mut enough) = (Mask::new(stark.rect), Mask::new(stark.rect));
    for (k, evidence) in evidence {
        certain.bits[*k] = stark.bits[*k] & u8::from(evidence.is(&CERTAIN));
        enough.bits[*k] = certain.bits[*k] | u8::from(evidence.is(&ENOUGH));
    }
    let seeds: Vec<Component> = (components(&certain).into_iter())
        .filter(|component| component.area >= LEAST_AREA_PX)
        .collect();
    let mut seeded = Mask::new(stark.rect);
    for seed in &seeds {
        seeded.add(&seed.mask(seed.rect));
    }
    let mut found = Mask::new(stark.rect);
    for component in components(&enough) {
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

/// The occluders' own color, F = (B - (1 - w) S) / w, with S that of the plate's ring, and their share.
fn picture(plate: &RgbImage, found: &Mask, evidence: &[(usize, Evidence)]) -> RgbaImage {
    let within = found.rect;
    let known = |k: usize| i32::from(found.bits[k] == 0);
    let n = SummedArea::of(within, known);
    let of_channel = |c: usize| {
        SummedArea::of(within, |k| {
            known(k) * i32::from(color_at(plate, within, k)[c])
        })
    };
    let sums = [0, 1, 2].map(of_channel);
    let mut picture = RgbaImage::new(plate.width, plate.height);
    for (k, evidence) in evidence.iter().filter(|(k, _)| found.bits[*k] == 1) {
        let (x, y) = (k % within.w as usize, k / within.w as usize);
        let n = n.ring(x, y);
        let (share, shown) = (evidence.share(), color_at(plate, within, *k).map(f64::from));
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
