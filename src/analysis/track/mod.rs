//! Follows the animal through the footage (Nakajima et al., section 4).
//!
//! Every whole frame is compared with the background of its scene, block by block. This costs less than the
//! paper's spiral of probes around a predicted place. Each component that may be the animal becomes a
//! candidate and is cut out. When all frames are read, `path` chooses one candidate per frame. So the first
//! thing in view is not mistaken for the animal. `movers` reports everything else that moved. See
//! docs/explanation/algorithms.md, "Tracking".

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
use super::{Error, MIN_FRAMES, Params};
use crate::geometry::Rect;
use crate::library::Mover;
use crate::progress::Progress;
use crate::raster::runs::Component;
use crate::raster::{Frame, RgbaImage};
use crate::scratch::{Full, Scratch};

/// Greatest number of candidates per frame. Free choice.
const MOST_CANDIDATES: usize = 3;
/// A component above this multiple of the animal's median area is also tried in parts: it may be the animal
/// and something that touches it. Free choice.
const MERGED: f64 = 1.2;
/// Extra cost of a candidate that is a part of a component. Free choice.
const PART_COST: f64 = 2.0;
/// One frame in this many keeps the animal's surroundings. Free choice: it bounds the memory.
const AROUND_EVERY: usize = 8;
/// Least area of a reported mover, as a share of the animal's median area. Free choice.
const LEAST_OTHER: f64 = 0.2;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// Presentation time of the frame, seconds from the first frame.
    pub time_s: f64,
    /// Index of the background that the frame was compared with; `None` when the frame shows another scene.
    pub plate_idx: Option<usize>,
    /// The animal; `None` when it was not found.
    pub sighting: Option<Sighting>,
}

impl Tracked {
    /// Returns the animal if it was found in front of the main background.
    pub fn before_main_plate(&self) -> Option<&Sighting> {
        let sighting = self.sighting.as_ref();
        sighting.filter(|_| self.plate_idx == Some(0))
    }
}

/// All frames of the footage, and the storage of their mattes.
#[derive(Debug)]
pub struct Track {
    /// One entry per frame, in order.
    pub frames: Vec<Tracked>,
    /// Things other than the animal that moved.
    pub movers: Vec<Mover>,
    /// Storage of the mattes' pixels.
    pub scratch: Arc<dyn Scratch>,
}

impl Track {
    /// Reads the matte of a sighting: straight alpha, of the size of its `rect`.
    pub fn image(&self, sighting: &Sighting) -> RgbaImage {
        let mut image = RgbaImage::new(sighting.rect.w, sighting.rect.h);
        self.scratch.get(sighting.at, &mut image.pixels);
        image
    }
}

/// Candidates and other components of one frame.
struct Seen {
    time_s: f64,
    plate_idx: Option<usize>,
    candidates: Vec<Candidate>,
    others: Vec<Other>,
}

/// Follows the animal through the footage; returns one entry per frame.
///
/// Fails with `TooFewFrames`, with `NothingMoves` when no frame shows the animal, and when the scratch is
/// full. Fails with `Cancelled` when `progress` says so.
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
        batches.recycle(batch);
        let share = seen.len() as f64 / n_frames_hint.max(1) as f64;
        progress.report("tracking", share);
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
    }
    if seen.len() < MIN_FRAMES {
        return Err(Error::TooFewFrames {
            n_frames: seen.len(),
            least: MIN_FRAMES,
        });
    }
    let candidates: Vec<&[Candidate]> = seen.iter().map(|s| s.candidates.as_slice()).collect();
    let pin = params.animal_at.and_then(|at| {
        let candidates = candidates.get(at.frame as usize)?;
        Some((at.frame as usize, nearest_to(candidates, at.at_px)?))
    });
    // A pinned animal is followed even when a larger one is in view.
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

/// Compares one frame with its background and measures the candidates.
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

/// Returns the candidates of a frame and the components that may be movers.
///
/// Candidates are components, or parts of them, with their looks and costs; the cheapest come first.
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

/// Returns the index of the candidate whose centroid is nearest to a point; `None` without candidates.
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
