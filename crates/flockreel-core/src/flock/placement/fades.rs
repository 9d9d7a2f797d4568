//! Cross-fades at jumps: a second sprite shows the continuation of the old run, or the beginning of the new one
//! (docs/explanation/algorithms.md, "Placement").

use super::{Placed, Placer, is_jump};
use crate::flock::individual::{BoidTrack, Fade};
use crate::geometry::rounded;

/// Inputs of fades: the states shown, with headings, depths and size.
pub(super) struct FadeInputs<'a> {
    pub(super) shown: &'a [(u32, bool)],
    pub(super) heading_rad: &'a [f64],
    pub(super) depth_bl: &'a [f64],
    pub(super) size: f64,
}

impl Placer<'_> {
    /// Returns the fades of a loop, by id. A fade across its end continues in the continuation's fades.
    pub(super) fn fades_across(
        &self,
        shown: &[&[(u32, bool)]],
        boids: &[BoidTrack],
        continuations: &[u32],
        placed: &[Placed],
    ) -> Vec<Vec<Fade>> {
        let mut fades: Vec<Vec<Fade>> = vec![Vec::new(); shown.len()];
        for (id, &continuation) in continuations.iter().enumerate() {
            let (continuation, n_frames) = (continuation as usize, shown[id].len());
            let across = self.fades(
                &FadeInputs {
                    shown: &[shown[id], shown[continuation]].concat(),
                    heading_rad: &[id, continuation]
                        .map(|id| &placed[id].heading_rad[..])
                        .concat(),
                    depth_bl: &[id, continuation]
                        .map(|id| self.depths_bl(&boids[id]))
                        .concat(),
                    size: 1.0,
                },
                n_frames,
            );
            for mut fade in across {
                let rest = fade.split_off(n_frames);
                fades[continuation].extend(rest);
                if !fade.weight.is_empty() {
                    fades[id].push(fade);
                }
            }
        }
        for fades in &mut fades {
            fades.sort_by_key(|fade| fade.start);
        }
        fades
    }

    /// Returns the fades at the jumps up to frame `n_frames`, the first one after the end.
    pub(super) fn fades(&self, inputs: &FadeInputs, n_frames: usize) -> Vec<Fade> {
        let shown = inputs.shown;
        let jumps: Vec<usize> = (1..shown.len())
            .filter(|&t| is_jump(shown[t - 1], shown[t]))
            .collect();
        let mut fades = Vec::new();
        let within = jumps.iter().take_while(|&&t| t <= n_frames);
        for (k, &t) in within.enumerate() {
            let before = if k > 0 { t - jumps[k - 1] } else { t };
            let after = jumps.get(k + 1).copied().unwrap_or(shown.len()) - t;
            let half = (self.params.fade_frames as usize / 2)
                .min(before / 2)
                .min(after / 2);
            if half > 0 {
                let halves = self.fade(inputs, t, half);
                fades.extend(halves.into_iter().flatten());
            }
        }
        fades
    }

    /// Returns the halves of a fade at the jump at `t`, `half` frames each: those before the new frame, and
    /// those after the old one. Returns `None` if a sprite is missing.
    fn fade(&self, inputs: &FadeInputs, t: usize, half: usize) -> Option<[Fade; 2]> {
        let (old, new) = (inputs.shown[t - 1], inputs.shown[t]);
        let mut sides: [Fade; 2] = [(t - half, new.1), (t, old.1)].map(|(start, mirrored)| Fade {
            start: start as u32,
            source_frame: Vec::new(),
            mirrored,
            rotation_rad: Vec::new(),
            scale: Vec::new(),
            weight: Vec::new(),
        });
        for u in t - half..t + half {
            let share = ((u + half - t) as f64 + 0.5) / (2 * half) as f64;
            let coming = share * share * (3.0 - 2.0 * share);
            let (side, frame, mirrored, weight) = if u < t {
                (0, new.0.checked_sub((t - u) as u32)?, new.1, coming)
            } else {
                (1, old.0 + (u - t + 1) as u32, old.1, 1.0 - coming)
            };
            let sprites = &self.library.sprites;
            if frame as usize >= sprites.n_frames() || !sprites.is_present(frame as usize) {
                return None;
            }
            let rotation = self.rotation((frame, mirrored), inputs.heading_rad[u]);
            sides[side].source_frame.push(frame);
            sides[side].rotation_rad.push(rounded(rotation, 5));
            sides[side]
                .scale
                .push(self.scale(frame, inputs.depth_bl[u], inputs.size));
            sides[side].weight.push(rounded(weight, 4));
        }
        Some(sides)
    }
}
