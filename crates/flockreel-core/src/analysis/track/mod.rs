//! Follows the animal through the footage (Nakajima et al., section 4).
//!
//! Every whole frame is compared with the background of its scene, block by block. This costs less than the
//! paper's spiral of probes around a predicted place. Each component that may be the animal becomes a
//! candidate and is cut out. When all frames are read, `path` chooses one candidate per frame. So the first
//! thing in view is not mistaken for the animal. `movers` lists everything else that moved. See
//! docs/explanation/algorithms.md, "Tracking".

use std::sync::Arc;

use rayon::prelude::*;

pub mod asymmetry;
mod body;
mod confidence;
mod evidence;
mod identity;
mod motion;
mod movers;
mod path;
mod recut;
pub mod sighting;
mod stretch;

use self::movers::MoverSighting;
use self::sighting::{CandidateShape, FrameView, Sighting};
use self::stretch::Candidate;
use super::matte;
use super::params::Follow;
use super::read_ahead::Batches;
use super::scene::{Placed, Scene};
use super::silhouette::{self, tether};
use super::subject::{Look, MIN_AREA_PX};
use super::{Error, MIN_FRAMES, Params};
use crate::geometry::Rect;
use crate::library::{Disturbance, DisturbanceKind, Mover};
use crate::order;
use crate::progress::Progress;
use crate::raster::runs::Component;
use crate::raster::{Frame, RgbaImage};
use crate::scratch::{Full, Scratch};

/// Greatest number of candidates per frame. Free choice: it bounds the memory.
const MAX_CANDIDATES: usize = 16;
/// One frame in this many keeps the animal's surroundings. Free choice: it bounds the memory.
const SURROUNDINGS_EVERY: usize = 8;
/// Least area of a reported mover, as a share of the animal's median area. Free choice.
const MIN_MOVER_AREA: f64 = 0.2;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// Presentation time of the frame, seconds from the first frame.
    pub time_s: f64,
    /// Index of the background that the frame was compared with; `None` when the frame shows another scene.
    pub background_idx: Option<usize>,
    /// The animal; `None` when it was not found.
    pub sighting: Option<Sighting>,
}

impl Tracked {
    /// Returns the animal if it was found in front of the main background.
    pub fn before_main_background(&self) -> Option<&Sighting> {
        let sighting = self.sighting.as_ref();
        sighting.filter(|_| self.background_idx == Some(0))
    }
}

/// All frames of the footage, and the storage of their mattes.
#[derive(Debug)]
pub struct Track {
    /// One entry per frame, in order.
    pub frames: Vec<Tracked>,
    /// Things other than the animal that moved.
    pub movers: Vec<Mover>,
    /// Times in which the camera shakes, its focus hunts, or the light differs.
    pub disturbances: Vec<Disturbance>,
    /// Storage of the mattes' pixels.
    pub scratch: Arc<dyn Scratch>,
}

impl Track {
    /// Returns the times of the frames that show another scene, seconds.
    pub fn foreign_times_s(&self) -> Vec<f64> {
        let foreign = self.frames.iter().filter(|t| t.background_idx.is_none());
        foreign.map(|t| t.time_s).collect()
    }

    /// Reads the matte of a sighting: straight alpha, of the size of its `rect`.
    pub fn image(&self, sighting: &Sighting) -> RgbaImage {
        let mut image = RgbaImage::new(sighting.rect.w, sighting.rect.h);
        self.scratch.get(sighting.at, &mut image.pixels);
        image
    }
}

/// Candidates and possible movers of one frame.
struct FrameResult {
    time_s: f64,
    background_idx: Option<usize>,
    disturbance: Option<DisturbanceKind>,
    candidates: Vec<Candidate>,
    movers: Vec<MoverSighting>,
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
    let mut results: Vec<FrameResult> = Vec::with_capacity(n_frames_hint);
    while let Some(batch) = batches.next_batch()? {
        let first = results.len();
        let compared = |(k, (time_s, frame)): (usize, &(f64, Frame))| {
            compare(first + k, *time_s, frame, scene, params, &**scratch)
        };
        let of_batch: Result<Vec<FrameResult>, Full> =
            batch.par_iter().enumerate().map(compared).collect();
        results.extend(of_batch?);
        batches.recycle(batch);
        let share = results.len() as f64 / n_frames_hint.max(1) as f64;
        progress.report("tracking", share);
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
    }
    if results.len() < MIN_FRAMES {
        return Err(Error::TooFewFrames {
            n_frames: results.len(),
            least: MIN_FRAMES,
        });
    }
    let candidates: Vec<&[Candidate]> = results.iter().map(|r| r.candidates.as_slice()).collect();
    let pin = params.animal_at.and_then(|at| {
        let candidates = candidates.get(at.frame as usize)?;
        Some((at.frame as usize, nearest_candidate(candidates, at.at_px)?))
    });
    // A pinned animal is followed even when a larger one is in view.
    let follow = if pin.is_some() {
        Follow::One
    } else {
        params.follow
    };
    let chosen = path::choose(&candidates, &scene.subject, follow, pin);
    let chosen = examined(chosen, &candidates);
    let movers = results.iter().zip(&chosen).map(|(result, &chosen)| {
        let box_px = chosen.map(|(at, _)| result.candidates[at].look.box_px);
        movers::outside_animal(&result.movers, box_px)
    });
    let times_s: Vec<f64> = results.iter().map(|r| r.time_s).collect();
    let movers = movers::gather(&movers.collect::<Vec<_>>(), &times_s);
    let disturbed: Vec<_> = results.iter().map(|result| result.disturbance).collect();
    let disturbances = movers::disturbances(&disturbed, &times_s);
    let is_whole = confidence::that_whole(scene.still_px > 0);
    let tracked = results.into_iter().zip(chosen);
    let tracked = tracked.map(|(result, chosen)| {
        result.with_chosen(chosen.map(|(at, confidence)| (at, is_whole * confidence)))
    });
    let mut frames: Vec<Tracked> = tracked.collect();
    if frames.iter().all(|t| t.sighting.is_none()) {
        return Err(Error::NothingMoves);
    }
    recut::all(&mut frames, scene, &**scratch, progress)?;
    let scratch = Arc::clone(scratch);
    Ok(Track {
        frames,
        movers,
        disturbances,
        scratch,
    })
}

/// Lowers the confidence of sightings by evidence from outside the subject. A sighting that is probably wrong is
/// dropped.
fn examined(
    chosen: Vec<Option<(usize, f64)>>,
    candidates: &[&[Candidate]],
) -> Vec<Option<(usize, f64)>> {
    let at = |(t, found): (usize, &Option<(usize, f64)>)| Some(&candidates[t][found.as_ref()?.0]);
    let areas = chosen.iter().enumerate().filter_map(at);
    let usual_px = order::median(areas.map(|candidate| candidate.look.area_px));
    let judged = |(found, candidates): (Option<(usize, f64)>, &&[Candidate])| {
        let (at, confidence) = found?;
        let Candidate { look, sighting, .. } = &candidates[at];
        let share = look.area_px / usual_px?;
        let edges = sighting.edge_share.unwrap_or(1.0);
        let confidence = confidence::of_extent(confidence, share, edges);
        (confidence >= confidence::FOUND).then_some((at, confidence))
    };
    chosen.into_iter().zip(candidates).map(judged).collect()
}

impl FrameResult {
    /// Returns the frame with the sighting of the chosen candidate, given by its index and confidence.
    fn with_chosen(self, chosen: Option<(usize, f64)>) -> Tracked {
        let sighting = chosen.and_then(|(at, confidence)| {
            let candidate = self.candidates.into_iter().nth(at)?;
            Some(Sighting {
                confidence,
                ..candidate.sighting
            })
        });
        Tracked {
            time_s: self.time_s,
            background_idx: self.background_idx,
            sighting,
        }
    }
}

/// Compares one frame with its background and measures the candidates.
fn compare(
    frame_idx: usize,
    time_s: f64,
    frame: &Frame,
    scene: &Scene,
    params: &Params,
    scratch: &dyn Scratch,
) -> Result<FrameResult, Full> {
    let Some(placed) = scene.place(frame_idx, frame) else {
        return Ok(FrameResult {
            time_s,
            background_idx: None,
            disturbance: None,
            candidates: Vec::new(),
            movers: Vec::new(),
        });
    };
    let ignored = params.ignored_at(time_s, [frame.width, frame.height]);
    let components = components(frame, &placed, scene, &ignored);
    let (described, mut movers) = described(components, frame, &placed, scene);
    if placed.disturbance == Some(DisturbanceKind::Camera) {
        movers.clear(); // they are edges of the scene
    }
    let view = FrameView {
        view: matte::View {
            frame,
            background: placed.background,
            light: &placed.light,
            coat: &scene.coat,
            ignored: &ignored,
        },
        keeps_surroundings: !scene.is_masked && frame_idx.is_multiple_of(SURROUNDINGS_EVERY),
    };
    let mut candidates = Vec::with_capacity(described.len());
    for Described {
        component,
        look,
        cost,
    } in described
    {
        let silhouette = if scene.is_masked {
            component.mask(component.rect)
        } else {
            silhouette::smoothed(&component, frame.width, frame.height)
        };
        if silhouette.area() == 0 {
            continue;
        }
        let shape = CandidateShape {
            component,
            silhouette,
        };
        if let Some(sighting) = view.cut_out(&shape, scratch)? {
            candidates.push(Candidate {
                look,
                cost,
                sighting,
            });
        }
    }
    Ok(FrameResult {
        time_s,
        background_idx: Some(placed.background_idx),
        disturbance: placed.disturbance,
        candidates,
        movers,
    })
}

/// Returns the components of a frame, without tethers and split at a mirror's line.
fn components(
    frame: &Frame,
    placed: &Placed<'_>,
    scene: &Scene,
    ignored: &[Rect],
) -> Vec<Component> {
    let boxes = placed.boxes.clone();
    let mut components =
        silhouette::components_in_boxes(frame, placed.background, &placed.light, boxes, ignored);
    if let Some(thin_px) = scene.tether_px {
        let picture = [frame.width, frame.height];
        let cut = |component| tether::cut_all(component, thin_px, picture);
        components = components.into_iter().flat_map(cut).collect();
    }
    if let Some(mirror) = &scene.mirror {
        let split = |component| mirror.split(component);
        components = components.into_iter().flat_map(split).collect();
    }
    components
}

/// A component with its look, and its misfit to the subject.
struct Described {
    component: Component,
    look: Look,
    cost: f64,
}

/// Returns the components that may be the animal, those of the least misfit first, and those that may be
/// movers.
fn described(
    components: Vec<Component>,
    frame: &Frame,
    placed: &Placed<'_>,
    scene: &Scene,
) -> (Vec<Described>, Vec<MoverSighting>) {
    let subject = &scene.subject;
    let is_image = |look: &Look| {
        let mirror = scene.mirror;
        mirror.is_some_and(|mirror| mirror.is_image(look.centroid_px))
    };
    let mut described: Vec<Described> = Vec::new();
    let mut movers = Vec::new();
    for component in components {
        if component.area < MIN_AREA_PX {
            continue;
        }
        let look = measure_look(&component, frame, placed);
        if component.area as f64 >= MIN_MOVER_AREA * subject.area_px() {
            movers.push(MoverSighting::new(&look, subject, is_image(&look)));
        }
        let cost = subject.cost(&look);
        if cost < path::MAX_COST && !is_image(&look) {
            described.push(Described {
                component,
                look,
                cost,
            });
        }
    }
    described.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    described.truncate(MAX_CANDIDATES);
    (described, movers)
}

/// Returns the index of the candidate whose centroid is nearest to a point; `None` without candidates.
fn nearest_candidate(candidates: &[Candidate], point_px: [f64; 2]) -> Option<usize> {
    let distance_px = |at: &usize| {
        let [x, y] = candidates[*at].look.centroid_px;
        libm::hypot(x - point_px[0], y - point_px[1])
    };
    (0..candidates.len()).min_by(|a, b| distance_px(a).total_cmp(&distance_px(b)))
}

fn measure_look(component: &Component, frame: &Frame, placed: &Placed<'_>) -> Look {
    let difference =
        silhouette::difference(frame, placed.background, &placed.light, component.rect);
    let picture = [frame.width, frame.height];
    Look::measure(
        component,
        &difference.rgb,
        &difference.levels,
        picture,
        placed.background.light,
    )
}
