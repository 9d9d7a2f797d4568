//! Ground truth of a flock in common formats (docs/reference/formats.md, "Ground truth"): COCO, MOTChallenge,
//! label pictures and a CSV table. It is written frame by frame, so memory does not grow with the length of
//! the video.
//!
//! Coordinates are pixels of the video. A `track_id`, a label and a MOTChallenge identity are the id of
//! flock.json plus 1, because 0 is the background.

pub mod coco;
pub mod mot;
pub mod rle;
pub mod tracks;

use crate::flock::composite::truth::{FrameTruth, Seen};
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

/// Returns the file name of a frame's label picture, and of the frame in a picture sequence.
pub fn frame_name(frame_idx: usize) -> String {
    format!("{frame_idx:06}.png")
}

/// Yields all individuals with their truth in a frame, by id.
fn everyone<'a>(
    flock: &'a Flock,
    truth: &'a FrameTruth,
) -> impl Iterator<Item = (&'a Individual, &'a Seen)> {
    flock.individuals.iter().zip(&truth.seen)
}

/// Explanation of the files, for users who unpack them.
pub const README: &str = "\
The ground truth of a flock made by flockreel, told by the compositor itself.

masks/NNNNNN.png  labels, 16-bit gray: id + 1 of the individual that makes up at least half of the pixel, counting what
                  covers it; 0 where nobody does: the background, where soft edges of several meet, and where
                  something known to stand before them (wires of a cage: the library's occluders.png) is in the film.
                  A film without background has no such thing; of two films this is of the opaque one. Frames
                  from 000000.
shadows/NNNNNN.png  8-bit gray: the share of its light that the shadows of all take of a pixel, 255 = all of it, where no
                  animal covers it. Only in a film with shadows; labels take no notice of them.
coco.json         COCO instances. One annotation for each individual and frame in which it has a label:
                  segmentation (compressed run lengths, as pycocotools decodes them), bbox and area are of what is
                  visible; amodal_segmentation is of the whole animal within the picture, amodal_bbox and
                  amodal_area of the whole animal wherever it is; visibility is the share of its alpha that is seen.
                  track_id = label; heading_rad = atan2(dy, dx), y down; centroid_px = the animal's own centroid.
gt/gt.txt         MOTChallenge: frame, id, left, top, width, height, 1, 1, visibility. Frames, ids, left and top
seqinfo.ini       count from 1; boxes are amodal. Everyone who is at least partly in the picture,
                  hidden or not.
tracks.csv        one row for each frame and individual, hidden or not. Boxes are x, y, width, height from 0; empty
                  where there is none.

Coordinates are pixels of the film: x right, y down, the center of the first pixel at (0.5, 0.5); lengths in px, times
in s, angles in rad. The pictures named in coco.json and seqinfo.ini are the film's frames:
    mkdir -p frames img1
    ffmpeg -i video.mp4 -fps_mode passthrough -start_number 0 frames/%06d.png
    ffmpeg -i video.mp4 -fps_mode passthrough img1/%06d.png
";

#[cfg(test)]
mod tests;
