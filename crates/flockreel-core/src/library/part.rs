//! Puts the library of a part of a footage into the whole: frames before and after the part have no animal.

use super::{Library, Pose};

impl Library {
    /// Renumbers the frames so that the first one becomes frame `first` of the footage, and adds frames without an
    /// animal before them and after them, up to `n_frames`. Statistics stay those of the part.
    pub fn place_in_footage(&mut self, first: usize, n_frames: usize) {
        let fps = self.poses.fps;
        let empty = |frame_idx: usize| Pose {
            time_s: frame_idx as f64 / fps,
            ..Pose::default()
        };
        let end = first + self.poses.frames.len();
        let n_after = n_frames.saturating_sub(end);
        let frames = std::mem::take(&mut self.poses.frames);
        let before = (0..first).map(empty);
        let after = (end..end + n_after).map(empty);
        self.poses.frames = before.chain(frames).chain(after).collect();
        let beats = self.poses.tail_beat.iter_mut();
        for span in beats.flat_map(|beat| &mut beat.spans) {
            span.frames = span.frames.map(|frame| frame + first);
            span.start_s += first as f64 / fps;
            span.end_s += first as f64 / fps;
        }
        self.sprites.pad(first, n_after);
        let offset = first as u32;
        for transition in &mut self.transitions {
            transition.from += offset;
            transition.to += offset;
        }
        for jump in &mut self.playback.jumps {
            jump.from += offset;
            jump.to += offset;
        }
        let component = self.playback.component.iter_mut();
        component.for_each(|frame| *frame += offset);
        for patch in &mut self.patches {
            patch.frames = patch.frames.start + offset..patch.frames.end + offset;
        }
    }
}
