//! coco.json in the COCO format: one annotation for each individual and frame in which it is visible, with mask,
//! box and keypoints. Track ids and other known values are additional fields (docs/reference/formats.md,
//! "Ground truth").
//!
//! A data set joins the images and annotations of many flocks in one file.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::json;

use super::{FilmShape, flag, frame_name, rle, with_truth};
use crate::flock::Flock;
use crate::flock::composite::keypoints::{N_KEYPOINTS, NAMES};
use crate::flock::composite::truth::{FrameTruth, Keypoint, Seen};
use crate::geometry::{Rect, rounded};

/// Writes a coco.json.
pub struct Coco<W: Write> {
    out: W,
    n_annotations: u64,
}

/// A picture in the list `images`.
#[derive(Serialize)]
pub struct Image {
    /// Number, from 1.
    pub id: u64,
    /// Path of the picture.
    pub file_name: String,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Frame of the flock, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
}

/// An individual in the list `annotations`.
#[derive(Serialize)]
pub struct Annotation {
    /// Number in the file, from 1.
    pub id: u64,
    image_id: u64,
    category_id: u32,
    /// The label: the id of the individual plus 1.
    pub track_id: u32,
    iscrowd: u32,
    area: u32,
    bbox: [u32; 4],
    segmentation: RunLengths,
    visibility: f64,
    amodal_area: u32,
    amodal_bbox: Option<[i64; 4]>,
    amodal_segmentation: RunLengths,
    centroid_px: [f64; 2],
    heading_rad: f64,
    forward: Option<[f64; 3]>,
    depth_m: Option<f64>,
    depth_rank: u32,
    keypoints: Vec<f64>,
    num_keypoints: usize,
    keypoint_source: &'static str,
    source_frame: u32,
    mirrored: bool,
}

/// `size` is [height, width], as in COCO.
#[derive(Serialize)]
struct RunLengths {
    size: [u32; 2],
    counts: String,
}

impl<W: Write> Coco<W> {
    /// Starts the file with everything known before the first frame.
    pub fn begin(mut out: W, film: &FilmShape) -> io::Result<Coco<W>> {
        let version = env!("CARGO_PKG_VERSION");
        write!(
            out,
            "{{\"info\":{{\"description\":\"a flock made by flockreel\",\"version\":\"{version}\",\
             \"fps\":{}}},\"licenses\":[],\"categories\":[{}],\"images\":[",
            film.fps,
            category()
        )?;
        for frame in 0..film.n_frames {
            let name = format!("frames/{}", frame_name(frame));
            let image = Image::new(frame as u64 + 1, name, film, frame);
            out.write_all(if frame == 0 { b"\n" } else { b",\n" })?;
            serde_json::to_writer(&mut out, &image)?;
        }
        out.write_all(b"],\"annotations\":[")?;
        Ok(Coco {
            out,
            n_annotations: 0,
        })
    }

    /// Adds the annotations of all visible individuals in a frame.
    pub fn add(&mut self, flock: &Flock, frame_idx: usize, truth: &FrameTruth) -> io::Result<()> {
        for mut annotation in annotations(flock, frame_idx, truth, frame_idx as u64 + 1) {
            let first = self.n_annotations == 0;
            self.n_annotations += 1;
            annotation.id = self.n_annotations;
            self.out.write_all(if first { b"\n" } else { b",\n" })?;
            serde_json::to_writer(&mut self.out, &annotation)?;
        }
        Ok(())
    }

    /// Completes the file.
    pub fn end(mut self) -> io::Result<()> {
        self.out.write_all(b"\n]}\n")?;
        self.out.flush()
    }
}

impl Image {
    /// Returns the entry of a frame of a film.
    pub fn new(id: u64, file_name: String, film: &FilmShape, frame: usize) -> Image {
        Image {
            id,
            file_name,
            width: film.size_px[0],
            height: film.size_px[1],
            frame,
            time_s: rounded(frame as f64 / film.fps, 6),
        }
    }
}

/// Returns the only entry of the list `categories`: the animal, with the names and joints of its keypoints.
pub fn category() -> String {
    // The centroid, which is the last keypoint, belongs to no joint.
    let skeleton: Vec<[usize; 2]> = (1..N_KEYPOINTS - 1).map(|k| [k, k + 1]).collect();
    json!({
        "id": 1,
        "name": "animal",
        "supercategory": "animal",
        "keypoints": NAMES,
        "skeleton": skeleton,
    })
    .to_string()
}

/// Returns the annotations of all visible individuals in a frame. Their `id` is 0.
pub fn annotations<'a>(
    flock: &'a Flock,
    frame_idx: usize,
    truth: &'a FrameTruth,
    image_id: u64,
) -> impl Iterator<Item = Annotation> + 'a {
    with_truth(flock, truth).filter_map(move |(individual, seen)| {
        let visible_box = seen.visible_box?;
        Some(Annotation {
            id: 0,
            image_id,
            category_id: 1,
            track_id: individual.id + 1,
            iscrowd: 0,
            area: seen.visible_area,
            bbox: [visible_box.x, visible_box.y, visible_box.w, visible_box.h],
            segmentation: visible(truth, visible_box, individual.id),
            visibility: rounded(seen.visibility, 4),
            amodal_area: seen.amodal_area,
            amodal_bbox: seen.amodal_box,
            amodal_segmentation: amodal(truth.size_px, seen),
            centroid_px: seen.centroid_px.map(|px| rounded(px, 3)),
            heading_rad: individual.heading_rad[frame_idx],
            forward: individual.forward.as_ref().map(|all| all[frame_idx]),
            depth_m: individual.depth_m.as_ref().map(|all| all[frame_idx]),
            depth_rank: seen.depth_rank,
            keypoints: seen.keypoints.iter().flat_map(keypoint).collect(),
            num_keypoints: seen.keypoints.iter().flatten().count(),
            keypoint_source: seen.keypoint_source.name(),
            source_frame: individual.source_frame[frame_idx],
            mirrored: individual.mirrored[frame_idx],
        })
    })
}

/// Returns x, y and the flag of COCO: 2 visible, 1 hidden, 0 not measured.
fn keypoint(point: &Option<Keypoint>) -> [f64; 3] {
    point.map_or([0.0; 3], |Keypoint { px: [x, y], .. }| {
        [rounded(x, 3), rounded(y, 3), f64::from(flag(point))]
    })
}

fn visible(truth: &FrameTruth, rect: Rect, id: u32) -> RunLengths {
    let width = truth.size_px[0];
    let is_set = |x: u32, y: u32| u32::from(truth.labels[(y * width + x) as usize]) == id + 1;
    run_lengths(truth.size_px, rect, is_set)
}

fn amodal(size_px: [u32; 2], seen: &Seen) -> RunLengths {
    let rect = seen.silhouette.rect;
    let is_set =
        |x: u32, y: u32| seen.silhouette.bits[((y - rect.y) * rect.w + x - rect.x) as usize] == 1;
    run_lengths(size_px, rect, is_set)
}

fn run_lengths(size_px: [u32; 2], rect: Rect, is_set: impl Fn(u32, u32) -> bool) -> RunLengths {
    RunLengths {
        size: [size_px[1], size_px[0]],
        counts: rle::text(&rle::counts(size_px, rect, is_set)),
    }
}
