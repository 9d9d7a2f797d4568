//! Preview of an analysis: the animal in the samples of a film, and the reason for which the film would be refused.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::samples::Samples;
use super::survey::Survey;
use crate::analysis::Error;
use crate::geometry::Rect;
use crate::raster::outline;
use crate::raster::runs::Component;

/// The samples of a film with the animal in them, and the verdict on the film.
#[derive(Debug)]
pub struct Preview {
    /// The samples, in the order of time.
    pub frames: Vec<SeenFrame>,
    /// Reason for which an analysis would refuse the film.
    pub refused: Option<Error>,
}

/// The animal and everything else that differs from the background, in one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeenFrame {
    /// Frame number in the film.
    pub frame: usize,
    /// Outline of what would be measured as the animal, a closed line, pixels; null where nothing would be.
    pub animal_px: Option<Vec<[f64; 2]>>,
    /// Left, top, width and height of everything else that differs from the background, pixels.
    pub others_px: Vec<[u32; 4]>,
}

impl Preview {
    /// Returns the preview in frames and pixels of the footage. The previewed part starts at frame `first` and was read at
    /// `scale` times its size.
    pub(in crate::analysis) fn in_footage(mut self, first: usize, scale: f64) -> Preview {
        for seen in &mut self.frames {
            seen.frame += first;
            for value in seen.animal_px.iter_mut().flatten().flatten() {
                *value = (*value / scale * 10.0).round() / 10.0;
            }
            for one in &mut seen.others_px {
                let [x, y, w, h] = *one;
                let larger = Rect::new(x, y, w, h).scaled(1.0 / scale);
                *one = [larger.x, larger.y, larger.w, larger.h];
            }
        }
        self.refused = (self.refused).map(|error| error.in_footage(first, scale));
        self
    }
}

/// Returns the animal and the other components of each sample.
pub(super) fn seen(samples: &Samples, survey: &Survey) -> Vec<SeenFrame> {
    let box_of = |component: &Component| {
        let rect = component.rect;
        [rect.x, rect.y, rect.w, rect.h]
    };
    let seen = |k: usize| {
        let (components, animal) = (&survey.components[k], survey.animal[k]);
        let others = components.iter().enumerate();
        SeenFrame {
            frame: samples.frame_idx[k],
            animal_px: animal.and_then(|at| outline_of(&components[at])),
            others_px: others
                .filter(|(at, _)| animal != Some(*at))
                .map(|(_, component)| box_of(component))
                .collect(),
        }
    };
    (0..samples.frames.len()).map(seen).collect()
}

/// Returns the outline of a component; `None` for a single pixel.
fn outline_of(component: &Component) -> Option<Vec<[f64; 2]>> {
    let mask = component.mask(component.rect);
    let alpha: Vec<u8> = mask.bits.iter().map(|bit| bit * u8::MAX).collect();
    outline::outline(component.rect, &alpha)
}
