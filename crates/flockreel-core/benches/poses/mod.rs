//! Poses of a film from the side, for the benchmarks.

use flockreel_core::library::{Pose, Poses, View};

/// Returns poses of 640 x 480 pixels at 30 frames per second.
pub(crate) fn from_the_side(frames: Vec<Pose>) -> Poses {
    Poses {
        tail_beat: None,
        fps: 30.0,
        image_size_px: [640, 480],
        view: View::Side,
        view_confidence: None,
        other_movers: Vec::new(),
        camera: None,
        animal: None,
        frames,
    }
}
