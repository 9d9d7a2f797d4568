//! The animal followed through the film (N 4; ALGORITHMS.md 2.6, 3).
//!
//! Every frame is compared with the plate of its scene, as a whole: means of 4 x 4 blocks say where a closer look is worth
//! it, which costs less than N's spiral of probes around a predicted place. Each component that may be the subject becomes a
//! candidate and is cut out. The path through the candidates of all frames is chosen at the end (`path`), so that whoever
//! is there first is not taken for the animal; what else moved is reported (`movers`).

use std::sync::Arc;

use rayon::prelude::*;

pub mod asymmetry;
mod body;
mod confidence;
mod movers;
mod parting;
mod path;
pub mod sighting;

use self::movers::Other;
use self::path::Candidate;
use self::sighting::{Choice, Sighting, View};
use super::params::Follow;
use super::read_ahead::Batches;
use super::scene::{Placed, Scene};
use super::silhouette::{self, tether};
use super::subject::{LEAST_AREA_PX, Look};
use super::{Error, LEAST_FRAMES, Params};
use crate::geometry::Rect;
use crate::library::Mover;
use crate::progress::Progress;
use crate::raster::runs::Component;
use crate::raster::{Frame, RgbaImage};
use crate::scratch::{Full, Scratch};

/// Candidates of a frame, at most.
const MOST_CANDIDATES: usize = 3;
/// A component of this many times the subject's usual area may be the animal and something else that it touches.
const MERGED: f64 = 1.2;
/// Cost of taking a part of a component for the animal instead of the whole.
const PART_COST: f64 = 2.0;
/// The surroundings of the animal are kept of one in this many frames: a bound on the memory that they take.
const AROUND_EVERY: usize = 8;
/// Something of this share of the subject's area that moves besides it is worth a word.
const LEAST_OTHER: f64 = 0.2;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// True time of the picture, seconds from the first frame.
    pub time_s: f64,
    /// Which plate the frame was compared with; `None` where it shows no known scene.
    pub plate_idx: Option<usize>,
    /// The animal, where it was found.
    pub sighting: Option<Sighting>,
}

impl Tracked {
    /// The animal, where it was found before the main plate.
    pub fn before_main_plate(&self) -> Option<&Sighting> {
        let sighting = self.sighting.as_ref();
        sighting.filter(|_| self.plate_idx == Some(0))
    }
}

/// All frames of a footage, and where the pixels of the animal are kept.
#[derive(Debug)]
pub struct Track {
    /// In order.
    pub frames: Vec<Tracked>,
    /// What moved besides the animal.
    pub movers: Vec<Mover>,
    /// Holds the pixels of the animal.
    pub scratch: Arc<dyn Scratch>,
}

impl Track {
    /// The animal cut out: straight alpha, of the size of the sighting's `rect`.
    pub fn image(&self, sighting: &Sighting) -> RgbaImage {
        let mut image = RgbaImage::new(sighting.rect.w, sighting.rect.h);
        self.scratch.get(sighting.at, &mut image.pixels);
        image
    }
}

/// What one frame shows.
struct Seen {
    time_s: f64,
    plate_idx: Option<usize>,
    candidates: Vec<Candidate>,
    others: Vec<Other>,
}

/// Follows the animal through the footage: one entry a frame.
///
/// Fails when the footage is too short, when nothing is found in any frame, when the scratch is full, and with
/// `Cancelled` soon after `progress` says so.
pub fn follow(
    batches: Batches,
    n_frames_hint: usize,
    scene: &Scene,
    params: &Params,
    scratch: &Arc<dyn Scratch>,
    progress: &dyn Progress,
) -> Result<Track, Error> {
    let mut seen: Vec<Seen> = Vec::with_capacity(n_frames_hint);
    while let Some(batch) = batches.next_batch()? {
        let first = seen.len();
        let of = |(k, (time_s, frame)): (usize, &(f64, Frame))| {
            look(first + k, *time_s, frame, scene, params, &**scratch)
        };
        let of_batch: Result<Vec<Seen>, Full> = batch.par_iter().enumerate().map(of).collect();
        seen.extend(of_batch?);
        batches.give_back(batch);
        let share = seen.len() as f64 / n_frames_hint.max(1) as f64;
        progress.report("tracking", share);
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
    }
    if seen.len() < LEAST_FRAMES {
        return Err(Error::TooFewFrames {
            n_frames: seen.len(),
            least: LEAST_FRAMES,
        });
    }
    let candidates: Vec<&[Candidate]> = seen.iter().map(|s| s.candidates.as_slice()).collect();
    let pin = params.animal_at.and_then(|at| {
        let candidates = candidates.get(at.frame as usize)?;
        Some((at.frame as usize, nearest_to(candidates, at.point)?))
    });
    // Who points at the animal follows that one.
    let follow = if pin.is_some() {
        Follow::One
    } else {
        params.follow
    };
    let chosen = path::choose(&candidates, &scene.subject, follow, pin);
    let others = seen.iter().zip(&chosen).map(|(seen, &chosen)| {
        let box_px = chosen.map(|(at, _)| seen.candidates[at].look.box_px);
        movers::beside(&seen.others, box_px)
    });
    let times_s: Vec<f64> = seen.iter().map(|s| s.time_s).collect();
    let movers = movers::gathered(&others.collect::<Vec<_>>(), &times_s);
    let tracked = seen.into_iter().zip(chosen).map(|(seen, chosen)| Tracked {
        time_s: seen.time_s,
        plate_idx: seen.plate_idx,
        sighting: chosen.and_then(|(at, confidence)| {
            let candidate = seen.candidates.into_iter().nth(at)?;
            Some(Sighting {
                confidence,
                ..candidate.sighting
            })
        }),
    });
    let frames: Vec<Tracked> = tracked.collect();
    if frames.iter().all(|t| t.sighting.is_none()) {
        return Err(Error::NothingMoves);
    }
    let scratch = Arc::clone(scratch);
    Ok(Track {
        frames,
        movers,
        scratch,
    })
}

/// Looks at one frame: what differs from its plate, and which of it may be the animal.
fn look(
    frame_idx: usize,
    time_s: f64,
    frame: &Frame,
    scene: &Scene,
    params: &Params,
    scratch: &dyn Scratch,
) -> Result<Seen, Full> {
    let Some(placed) = scene.place(frame_idx, frame) else {
        return Ok(Seen {
            time_s,
            plate_idx: None,
            candidates: Vec::new(),
            others: Vec::new(),
        });
    };
    let ignored = params.ignored_at(time_s, [frame.width, frame.height]);
    let (described, others) = described(frame, &placed, scene, &ignored);
    let view = View {
        frame,
        plate: placed.plate,
        light: &placed.light,
        ignored: &ignored,
        keeps_around: !scene.is_masked && frame_idx.is_multiple_of(AROUND_EVERY),
    };
    let mut candidates = Vec::with_capacity(described.len());
    for (component, look, cost) in described {
        let silhouette = match scene.is_masked {
            true => component.mask(component.rect),
            false => silhouette::shaped(&component, frame.width, frame.height),
        };
        if silhouette.area() == 0 {
            continue;
        }
        let choice = Choice {
            component,
            silhouette,
        };
        if let Some(sighting) = view.look(&choice, scratch)? {
            candidates.push(Candidate {
                look,
                cost,
                sighting,
            });
        }
    }
    Ok(Seen {
        time_s,
        plate_idx: Some(placed.plate_idx),
        candidates,
        others,
    })
}

/// The components of a frame that may be the animal, and parts of them, with their looks and costs, the cheapest first;
/// and all that are large enough to be told of if they are not.
fn described(
    frame: &Frame,
    placed: &Placed<'_>,
    scene: &Scene,
    ignored: &[Rect],
) -> (Vec<(Component, Look, f64)>, Vec<Other>) {
    let subject = &scene.subject;
    let is_image = |look: &Look| {
        scene
            .mirror
            .is_some_and(|mirror| mirror.is_image(look.centroid_px))
    };
    let boxes = placed.boxes.clone();
    let mut components =
        silhouette::components_of(frame, placed.plate, &placed.light, boxes, ignored);
    if let Some(thin_px) = scene.tether_px {
        let picture = [frame.width, frame.height];
        let cut = |component| tether::cut_all(component, thin_px, picture);
        components = components.into_iter().flat_map(cut).collect();
    }
    if let Some(mirror) = &scene.mirror {
        let parted = |component| mirror.parted(component);
        components = components.into_iter().flat_map(parted).collect();
    }
    let mut found: Vec<(Component, Look, f64)> = Vec::new();
    let mut others = Vec::new();
    for component in components {
        if component.area < LEAST_AREA_PX {
            continue;
        }
        let whole = describe(&component, frame, placed);
        if component.area as f64 >= LEAST_OTHER * subject.area_px() {
            others.push(Other::of(&whole, subject, is_image(&whole)));
        }
        if component.area as f64 > MERGED * subject.area_px() && !scene.is_masked {
            let difference =
                silhouette::difference(frame, placed.plate, &placed.light, component.rect);
            for part in parting::parts_of(&component, &difference, subject.area_px()) {
                let look = describe(&part, frame, placed);
                let cost = subject.cost(&look) + PART_COST;
                found.push((part, look, cost));
            }
        }
        let cost = subject.cost(&whole);
        found.push((component, whole, cost));
    }
    found.retain(|(_, look, cost)| *cost < path::MOST_COST && !is_image(look));
    found.sort_by(|a, b| a.2.total_cmp(&b.2));
    found.truncate(MOST_CANDIDATES);
    (found, others)
}

/// The candidate whose middle is nearest to a point.
fn nearest_to(candidates: &[Candidate], point_px: [f64; 2]) -> Option<usize> {
    let off = |at: &usize| {
        let [x, y] = candidates[*at].look.centroid_px;
        libm::hypot(x - point_px[0], y - point_px[1])
    };
    (0..candidates.len()).min_by(|a, b| off(a).total_cmp(&off(b)))
}

fn describe(component: &Component, frame: &Frame, placed: &Placed<'_>) -> Look {
    let difference = silhouette::difference(frame, placed.plate, &placed.light, component.rect);
    let picture = [frame.width, frame.height];
    Look::of(
        component,
        &difference.rgb,
        &difference.levels,
        picture,
        placed.plate.light,
    )
}
