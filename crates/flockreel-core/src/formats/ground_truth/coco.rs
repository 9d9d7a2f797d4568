//! coco.json in the COCO format: one annotation for each individual and frame in which it is visible. Track
//! ids and other known values are additional fields (docs/reference/formats.md, "Ground truth").

use std::io::{self, Write};

use serde::Serialize;

use super::{FilmShape, frame_name, rle, with_truth};
use crate::flock::Flock;
use crate::flock::composite::truth::{FrameTruth, Seen};
use crate::geometry::{Rect, rounded};

/// Writes a coco.json.
pub struct Coco<W: Write> {
    out: W,
    n_annotations: u64,
}

#[derive(Serialize)]
struct Image {
    id: usize,
    file_name: String,
    width: u32,
    height: u32,
    frame: usize,
    time_s: f64,
}

#[derive(Serialize)]
struct Annotation {
    id: u64,
    image_id: usize,
    category_id: u32,
    track_id: u32,
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
             \"fps\":{}}},\"licenses\":[],\"categories\":[{{\"id\":1,\"name\":\"animal\",\
             \"supercategory\":\"animal\"}}],\"images\":[",
            film.fps
        )?;
        for frame in 0..film.n_frames {
            let image = Image {
                id: frame + 1,
                file_name: format!("frames/{}", frame_name(frame)),
                width: film.size_px[0],
                height: film.size_px[1],
                frame,
                time_s: rounded(frame as f64 / film.fps, 6),
            };
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
        for (individual, seen) in with_truth(flock, truth) {
            let Some(visible_box) = seen.visible_box else {
                continue;
            };
            let first = self.n_annotations == 0;
            self.n_annotations += 1;
            let annotation = Annotation {
                id: self.n_annotations,
                image_id: frame_idx + 1,
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
                source_frame: individual.source_frame[frame_idx],
                mirrored: individual.mirrored[frame_idx],
            };
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
