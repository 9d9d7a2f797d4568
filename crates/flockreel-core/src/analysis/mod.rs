//! Turns a footage into a library: the pose of the animal in every frame, and the transitions between similar
//! moments.
//!
//! [`analyze`] runs all stages. The modules below follow its order.

mod memory;
pub mod params;

pub mod error;

// The scene, its difference from each frame, and the appearance of the animal.
pub mod scene;
pub mod silhouette;
pub mod subject;

// Tracking and cutting out the animal.
pub mod matte;
pub mod occluders;
mod palette;
pub mod read_ahead;
pub mod shadow;
pub mod track;

// The pose of the animal, and similar moments.
pub mod pose;
pub mod similarity;
pub mod stats;

pub use error::{Error, Evidence};
pub use params::Params;
use params::{CutSprites, ScaleMode};
use pose::{midline, sprite};
use scene::Scene;
use scene::background::Background;
use scene::preview::Preview;
use similarity::transition;
use track::Track;

use std::sync::Arc;

use crate::cpu;
use crate::footage::{FrameSource, Part};
use crate::library::{Library, LibraryStats, View};
use crate::progress::Progress;
use crate::raster::RgbImage;
use crate::scratch::Scratch;

/// Minimum number of frames in a footage. Free choice.
pub const MIN_FRAMES: usize = 16;

/// Analyses a footage and returns its library: background, poses, sprites, transitions.
///
/// Where the parameters select a part of the footage, only that part is measured. Frames keep their numbers and
/// times in the footage; those outside of the part have no animal.
///
/// `background` is an image of the empty scene, if one exists. The sprites are stored in `scratch`, where the
/// library reads them. The result depends only on the footage, the background and the parameters, not on the
/// machine or the number of threads.
///
/// Fails if the footage cannot become a library (docs/explanation/algorithms.md, "Refused footage"), and with
/// `Cancelled` soon after `progress` reports it.
pub fn analyze(
    source: &dyn FrameSource,
    background: Option<&RgbImage>,
    params: &Params,
    cpu: cpu::Level,
    scratch: &Arc<dyn Scratch>,
    progress: &dyn Progress,
) -> Result<Library, Error> {
    let part = Part::new(source, params.from_s, params.to_s);
    let first = part.first_frame();
    let params_of_part = params.counted_from(first);
    let mut library = analyze_part(&part, background, &params_of_part, cpu, scratch, progress)
        .map_err(|error| error.in_footage(first, 1.0))?;
    if params.from_s.is_some() || params.to_s.is_some() {
        library.place_in_footage(first, source.format().n_frames_hint);
    }
    Ok(library)
}

/// Finds the animal in about 40 frames of a footage, and decides whether [`analyze`] would refuse the footage.
///
/// `source` may show the footage at `scale` times its size; the result is in pixels of the footage. This takes a
/// fraction of the time of [`analyze`] and fails like it. A small picture hides small animals, and only [`analyze`] sees
/// every frame, so its result can differ.
pub fn preview(
    source: &dyn FrameSource,
    scale: f64,
    background: Option<&RgbImage>,
    params: &Params,
    progress: &dyn Progress,
) -> Result<Preview, Error> {
    let part = Part::new(source, params.from_s, params.to_s);
    let first = part.first_frame();
    let params = params.counted_from(first).scaled(scale);
    let preview = scene::preview(&part, background, &params, progress);
    preview
        .map(|preview| preview.in_footage(first, scale))
        .map_err(|error| error.in_footage(first, scale))
}

/// Analyses a part of a footage. Frames count from the start of the part.
fn analyze_part(
    source: &dyn FrameSource,
    background: Option<&RgbImage>,
    params: &Params,
    cpu: cpu::Level,
    scratch: &Arc<dyn Scratch>,
    progress: &dyn Progress,
) -> Result<Library, Error> {
    let n_frames = source.format().n_frames_hint;
    let (mut scene, mut track) = read_ahead::while_reading(source, |batches| {
        let scene = scene::estimate(source, background, params, progress)?;
        let track = track::follow(batches, n_frames, &scene, params, scratch, progress)?;
        Ok::<_, Error>((scene, track))
    })?;
    let backgrounds = scene.backgrounds.iter();
    let lights: Vec<usize> = backgrounds.map(|background| background.light).collect();
    let background = scene.backgrounds.swap_remove(0);
    let occluders = if scene.is_masked {
        None
    } else {
        occluders::remove(&mut track, &background, progress)?
    };
    let (view, view_confidence) = pose::view(&track.frames, params);
    let animal_too_small =
        params.sprites == CutSprites::Auto && sprite::is_too_small(&track.frames);
    let mut poses = pose::measure(&track.frames, view, &source.format(), params);
    poses.view_confidence = view_confidence;
    poses.other_movers = std::mem::take(&mut track.movers);
    midline::trace(&mut poses, &track);
    poses.tail_beat = midline::tail_beat::measure(&poses);
    let sprites = if animal_too_small {
        sprite::missing(track.frames.len())
    } else {
        let by_depth = params.scale_mode == ScaleMode::Depth && view == View::Side;
        let scales = by_depth.then(|| sprite::scales(&poses));
        let is_in_light = |background_idx: usize| lights[background_idx] == lights[0];
        sprite::align(&track, view, scales, is_in_light)
    };
    let length_px = (view == View::Top)
        .then(|| stats::length_px(&poses))
        .flatten();
    let shadow = length_px.and_then(|px| shadow::measure(&track, &background.rgb, px));
    let of_scene = scene_stats(&scene, &background, &track);
    drop(track);
    let connections = transition::connect(&sprites, &poses, params, cpu, progress)?;
    let stats = LibraryStats {
        animal_too_small,
        ..stats::library_stats(&poses, &connections, of_scene)
    };
    Ok(Library {
        poses,
        background: background.rgb,
        occluders,
        sprites,
        shadow,
        clip_frames: connections.clip_frames,
        epsilon: connections.epsilon,
        natural_step: connections.natural_step,
        transitions: connections.transitions,
        playback: connections.playback,
        patches: connections.patches,
        stats,
    })
}

/// Returns the statistics of the scene; the others are zero.
fn scene_stats(scene: &Scene, background: &Background, track: &Track) -> LibraryStats {
    let foreign_times_s = track.foreign_times_s();
    LibraryStats {
        never_seen_px: background.never_seen_px,
        still_px: scene.still_px,
        several_animals: scene.several_animals,
        n_foreign_frames: foreign_times_s.len(),
        first_foreign_s: foreign_times_s.first().copied(),
        disturbances: track.disturbances.clone(),
        ..LibraryStats::default()
    }
}
