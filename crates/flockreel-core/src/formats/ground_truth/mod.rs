//! Ground truth of a flock in common formats (docs/reference/formats.md, "Ground truth"): COCO, MOTChallenge,
//! label pictures and CSV tables. It is written frame by frame, so memory does not grow with the length of
//! the video.
//!
//! Coordinates are pixels of the video. A `track_id`, a label and a MOTChallenge identity are the id of
//! flock.json plus 1, because 0 is the background.

pub mod coco;
pub mod dlc;
pub mod mot;
pub mod report;
pub mod rle;
pub mod tracks;
pub mod yolo;

pub use super::picture_archive::frame_name;
use crate::flock::composite::truth::{FrameTruth, Keypoint, Seen};
use crate::flock::{Flock, Individual};

/// Size and length of the video that the ground truth describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmShape {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Number of frames.
    pub n_frames: usize,
    /// Frame rate, frames per second.
    pub fps: f64,
}

/// Yields all individuals with their truth in a frame, by id.
fn with_truth<'a>(
    flock: &'a Flock,
    truth: &'a FrameTruth,
) -> impl Iterator<Item = (&'a Individual, &'a Seen)> {
    flock.individuals.iter().zip(&truth.seen)
}

/// Returns the flag of a keypoint in files: 2 visible, 1 hidden by others or outside of the picture, 0 not measured.
fn flag(point: &Option<Keypoint>) -> u8 {
    point.map_or(0, |point| 1 + u8::from(point.is_visible))
}

/// Explanation of the files, for users who unpack them.
pub const README: &str = "\
The ground truth of a flock made by flockreel, computed by the compositor from the alpha with which it draws.

masks/NNNNNN.png  labels, 16-bit gray: id + 1 of the individual whose visible share of the pixel is at least half;
                  0 elsewhere: the background, soft edges where no individual reaches half, and occluders (such as
                  wires of a cage, see occluders.png of the library). A film without background has no occluders.
                  If an opaque and a transparent film are made, the labels belong to the opaque one. File numbers
                  start at 000000.
shadows/NNNNNN.png  8-bit gray: the share of the light that all shadows together remove from a pixel, 255 = all of
                  it, reduced by the alpha of what is in front. Only for films with shadows. Labels ignore shadows.
coco.json         COCO instances: one annotation per individual and frame with at least one labelled pixel.
                  segmentation (compressed run lengths for pycocotools), bbox and area describe the visible part;
                  amodal_segmentation describes the whole animal within the picture, amodal_bbox and amodal_area
                  the whole animal also beyond it; visibility is the share of the animal's alpha that lies in the
                  picture and is not covered.
                  track_id = label; heading_rad = atan2(dy, dx), y down; centroid_px = the animal's own centroid;
                  forward = direction of the head in space (x right, y down, z away), null without depth.
                  keypoints: x, y, v of the names in categories; v = 2 visible, 1 hidden by another animal or outside
                  of the picture, 0 not measured. keypoint_source: midline (measured in the filmed frame), body_ends
                  (the ends of the filmed silhouette) or none (centroid only).
gt/gt.txt         MOTChallenge: frame, id, left, top, width, height, 1, 1, visibility. Frames, ids, left and top
                  count from 1. Boxes are amodal. Every individual that is at least partly in the picture has a row,
                  hidden or not.
seqinfo.ini       MOTChallenge: frame rate, number of frames and picture size.
tracks.csv        one row per frame and individual, hidden or not. Boxes are x, y, width, height, counted from 0; a
                  missing box is empty, and so is a keypoint that was not measured.
tracks_dlc.csv    keypoints of all individuals in the layout of DeepLabCut's predictions, for movement and sleap-io.
                  likelihood: 1 visible, 0.5 hidden; a keypoint that was not measured is empty.
report.json       crossings, hidden spans and nearest distances.

Coordinates are pixels of the film: x right, y down, the center of the first pixel at (0.5, 0.5); lengths in px, times
in s, angles in rad. The pictures named in coco.json and seqinfo.ini are the film's frames:
    mkdir -p frames img1
    ffmpeg -i video.mp4 -fps_mode passthrough -start_number 0 frames/%06d.png
    ffmpeg -i video.mp4 -fps_mode passthrough img1/%06d.png
";

#[cfg(test)]
mod tests;
