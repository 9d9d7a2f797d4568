//! The animal followed from frame to frame (N 4; ALGORITHMS.md 2.6, 3).
//!
//! Its place is predicted by constant velocity; near it the component is taken that fits the track
//! in place and area. Another component elsewhere (a reflection, a second animal) is taken only when
//! nothing near the prediction has been seen for five frames, or when it is the only one there is.
//!
//! N probes squares on a lattice of 4 pixels in a spiral around the prediction; here the means of 4 x 4
//! blocks of the search window are compared, all of them, which costs less than the spiral's branches.
//! `search: full` compares those of the whole frame. The boxes they propose near the prediction are the
//! same, so is all that follows; and when nothing there fits, both look everywhere in that same frame,
//! which makes a search of the whole frame every so often needless.

use std::sync::Arc;

use rayon::prelude::*;

use super::background::Plate;
use super::light::{self, Gain};
use super::params::Search;
use super::read_ahead::Batches;
use super::sighting::{Choice, Scene, Sighting};
use super::silhouette::{self, parting};
use super::{Error, LEAST_FRAMES, Params};
use crate::geometry::Rect;
use crate::order;
use crate::progress::Progress;
use crate::raster::runs::Component;
use crate::raster::{Frame, RgbaImage};
use crate::scratch::{Full, Scratch};

/// Components smaller than this are noise.
const LEAST_AREA_PX: u64 = 12;
/// Frames without the animal before it is looked for anew, anywhere.
const MISSES: u32 = 5;
/// A box so many times as long as the animal's usual one is not the animal's.
const HUGE: f64 = 4.0;
/// A component of this many times the usual area may be the animal and something else ...
const MERGED: f64 = 1.2;
/// ... if the usual area is known from this many silhouettes.
const LEAST_AREAS: usize = 8;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// True time of the picture, seconds from the first frame.
    pub time_s: f64,
    /// The animal, where it was found.
    pub sighting: Option<Sighting>,
}

/// All frames of a footage, and where what was cut out of them lies.
#[derive(Debug)]
pub struct Track {
    /// In order.
    pub frames: Vec<Tracked>,
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

/// Follows the animal through the footage: one entry a frame.
///
/// Only the choice of the component needs the frames before; light, cutting out and measuring are
/// done for many frames at once.
pub fn follow(
    batches: Batches,
    n_frames_hint: usize,
    plate: &Plate,
    params: &Params,
    scratch: &Arc<dyn Scratch>,
    progress: &dyn Progress,
) -> Result<Track, Error> {
    let mut tracker = Tracker::new(plate, params);
    let mut frames = Vec::with_capacity(n_frames_hint);
    while let Some(batch) = batches.next_batch()? {
        let gains: Vec<Gain> = batch
            .par_iter()
            .map(|(_, frame)| light::gain(frame, plate))
            .collect();
        let choices: Vec<Option<Choice>> = batch
            .iter()
            .zip(&gains)
            .map(|((_, frame), gain)| tracker.step(frame, gain))
            .collect();
        let looks = batch.par_iter().zip(&gains).zip(choices);
        let seen: Vec<Tracked> = looks
            .map(|(((time_s, frame), gain), choice)| {
                let (time_s, view) = (*time_s, Scene { frame, plate, gain });
                let sighting = choice.map(|choice| view.look(&choice, &**scratch));
                let sighting = sighting.transpose()?.flatten();
                Ok(Tracked { time_s, sighting })
            })
            .collect::<Result<_, Full>>()?;
        frames.extend(seen);
        batches.give_back(batch);
        progress.report(
            "tracking",
            frames.len() as f64 / n_frames_hint.max(1) as f64,
        );
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
    }
    if frames.len() < LEAST_FRAMES {
        return Err(Error::TooFewFrames {
            n_frames: frames.len(),
            least: LEAST_FRAMES,
        });
    }
    drop_huge(&mut frames);
    if frames.iter().all(|t| t.sighting.is_none()) {
        return Err(Error::NothingMoves);
    }
    let scratch = Arc::clone(scratch);
    Ok(Track { frames, scratch })
}

/// Takes out what is far larger than the animal mostly is: a line of the scene that moved before the animal
/// was first seen, say. It may have the animal's area; its box tells.
fn drop_huge(frames: &mut [Tracked]) {
    let diagonal = |s: &Sighting| libm::hypot(f64::from(s.box_px.w), f64::from(s.box_px.h));
    let seen = frames.iter().filter_map(|t| t.sighting.as_ref());
    let usual = order::median(seen.map(diagonal));
    for tracked in frames {
        let huge = |s: &Sighting| usual.is_some_and(|usual| diagonal(s) > HUGE * usual);
        tracked.sighting.take_if(|s| huge(s));
    }
}

struct Tracker<'a> {
    plate: &'a Plate,
    params: &'a Params,
    whole: Rect,
    frame_idx: usize,
    /// The last two centroids, the newest first, and the frames they are from.
    last: Option<(usize, [f64; 2])>,
    velocity_px: [f64; 2],
    box_px: Rect,
    misses: u32,
    /// Areas of the last components, for their running median.
    areas: Vec<f64>,
}

impl<'a> Tracker<'a> {
    fn new(plate: &'a Plate, params: &'a Params) -> Tracker<'a> {
        Tracker {
            plate,
            params,
            whole: Rect::of_size(plate.frame.width, plate.frame.height),
            frame_idx: 0,
            last: None,
            velocity_px: [0.0; 2],
            box_px: Rect::default(),
            misses: MISSES,
            areas: Vec::new(),
        }
    }

    /// Looks at the next frame.
    fn step(&mut self, frame: &Frame, gain: &Gain) -> Option<Choice> {
        let found = self
            .near(frame, gain)
            .or_else(|| self.anywhere(frame, gain))
            .and_then(|component| {
                let silhouette = silhouette::shaped(&component, frame.width, frame.height);
                (silhouette.area() > 0).then_some(Choice {
                    component,
                    silhouette,
                })
            });
        match &found {
            Some(choice) => self.remember(&choice.component),
            None => self.misses = (self.misses + 1).min(MISSES),
        }
        self.frame_idx += 1;
        found
    }

    /// The best component in the search window; `None` when there is none, or no window to be trusted.
    fn near(&self, frame: &Frame, gain: &Gain) -> Option<Component> {
        if self.misses >= MISSES {
            return None;
        }
        let window = self.window();
        let seen = match self.params.search {
            Search::Window => window,
            Search::Full => self.whole,
        };
        let components = self.components(frame, gain, [window, seen]);
        self.best(&components, window)
    }

    /// The best component of the whole frame.
    fn anywhere(&self, frame: &Frame, gain: &Gain) -> Option<Component> {
        let components = self.components(frame, gain, [self.whole; 2]);
        if self.misses >= MISSES {
            return components
                .into_iter()
                .filter(|c| c.area >= LEAST_AREA_PX)
                .max_by_key(|c| c.area);
        }
        self.best(&components, self.window()).or_else(|| {
            let mut fitting = components.iter().filter(|c| self.fits(c));
            let only = fitting.next();
            only.filter(|_| fitting.next().is_none()).cloned()
        })
    }

    /// The components of [the window, what is seen]. One that is larger than the animal mostly is and that is two things
    /// counts with the part where the animal should be alone.
    fn components(&self, frame: &Frame, gain: &Gain, regions: [Rect; 2]) -> Vec<Component> {
        let mut components = silhouette::components(frame, self.plate, gain, regions);
        let Some(predicted) = self.predicted().filter(|_| self.areas.len() >= LEAST_AREAS) else {
            return components;
        };
        let known = parting::Known {
            usual_area: self.usual_area(),
            last_area: self.areas.last().copied().unwrap_or(1.0),
            place_px: predicted,
        };
        for component in &mut components {
            if component.area as f64 > MERGED * known.usual_area {
                let difference = silhouette::difference(frame, self.plate, gain, component.rect);
                if let Some(part) = parting::part_of(component, &difference, &known) {
                    *component = part;
                }
            }
        }
        components
    }

    /// Where the animal should be now; `None` before it was seen.
    fn predicted(&self) -> Option<[f64; 2]> {
        let (_, last) = self.last?;
        let steps = f64::from(self.misses + 1);
        Some([
            last[0] + self.velocity_px[0] * steps,
            last[1] + self.velocity_px[1] * steps,
        ])
    }

    /// The last box where it should be now, widened by how far it may have gone besides.
    fn window(&self) -> Rect {
        let steps = f64::from(self.misses + 1);
        let speed = libm::hypot(self.velocity_px[0], self.velocity_px[1]);
        let margin = (1.5 * speed + 8.0) * libm::pow(1.6, f64::from(self.misses));
        let (dx, dy) = (self.velocity_px[0] * steps, self.velocity_px[1] * steps);
        let last = self.box_px;
        Rect::clipped(
            (f64::from(last.x) + dx.min(0.0) - margin).floor() as i64,
            (f64::from(last.y) + dy.min(0.0) - margin).floor() as i64,
            (f64::from(last.right()) + dx.max(0.0) + margin).ceil() as i64,
            (f64::from(last.bottom()) + dy.max(0.0) + margin).ceil() as i64,
            self.whole.w,
            self.whole.h,
        )
    }

    /// The component of fitting area in the window that lies nearest the prediction and differs
    /// least in area.
    fn best(&self, components: &[Component], window: Rect) -> Option<Component> {
        let predicted = self.predicted()?;
        let scale = f64::from(self.box_px.w.max(self.box_px.h)).max(8.0);
        let usual = self.usual_area();
        let cost = |component: &Component| {
            let rect = component.rect;
            let center = [
                f64::from(rect.x) + f64::from(rect.w) / 2.0,
                f64::from(rect.y) + f64::from(rect.h) / 2.0,
            ];
            let distance = libm::hypot(center[0] - predicted[0], center[1] - predicted[1]);
            distance / scale + libm::log(component.area as f64 / usual).abs()
        };
        components
            .iter()
            .filter(|c| self.fits(c) && !c.rect.intersection(&window).is_empty())
            .min_by(|a, b| cost(a).total_cmp(&cost(b)))
            .cloned()
    }

    /// Whether a component may be the animal by its area: near what it was last, or near what it
    /// mostly is (an animal that turns toward the camera shrinks within a few frames).
    fn fits(&self, component: &Component) -> bool {
        let near = |area: f64| (0.4..=2.5).contains(&(component.area as f64 / area));
        component.area >= LEAST_AREA_PX
            && (near(self.usual_area()) || self.areas.last().copied().is_some_and(near))
    }

    /// The median area of the last silhouettes.
    fn usual_area(&self) -> f64 {
        let mut areas = self.areas.clone();
        if areas.is_empty() {
            return 1.0;
        }
        let middle = areas.len() / 2;
        *areas.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    fn remember(&mut self, component: &Component) {
        let centroid = component.centroid_px();
        self.velocity_px = match self.last {
            Some((frame_idx, last)) if self.misses < MISSES => {
                let steps = (self.frame_idx - frame_idx) as f64;
                [
                    (centroid[0] - last[0]) / steps,
                    (centroid[1] - last[1]) / steps,
                ]
            }
            _ => [0.0; 2],
        };
        self.last = Some((self.frame_idx, centroid));
        self.box_px = component.rect;
        self.misses = 0;
        if self.areas.len() == 61 {
            self.areas.remove(0);
        }
        self.areas.push(component.area as f64);
    }
}
