//! Hints from the user: the part of the footage to measure, the position of the animal, boxes to ignore.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Params;
use crate::geometry::Rect;
use crate::parameters::CoordinatePx;

/// The position of the animal in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct AnimalAtParam {
    /// Frame number in the film, counted from 0.
    pub frame: u32,
    /// A point on the animal, pixels.
    #[serde(alias = "point")]
    #[schema(value_type = [CoordinatePx; 2], inline, min_items = 2, max_items = 2)]
    pub at_px: [f64; 2],
}

/// A box in which nothing counts as the animal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct IgnoreParam {
    /// Left, top, width and height, pixels.
    #[schema(min_items = 4, max_items = 4)]
    pub box_px: [u32; 4],
    /// Start time, seconds. null = from the start of the footage.
    #[serde(default)]
    #[schema(default = json!(null), minimum = 0, maximum = 1000000)]
    pub from_s: Option<f64>,
    /// End time, seconds. null = to the end of the footage.
    #[serde(default)]
    #[schema(default = json!(null), exclusive_minimum = 0, maximum = 1000000)]
    pub to_s: Option<f64>,
}

impl Params {
    /// Returns the parameters for a part of the footage that starts at frame `first`: frame numbers count from there.
    /// Times still count from the start of the footage.
    pub(in crate::analysis) fn counted_from(&self, first: usize) -> Params {
        let counted = |frame: u32| frame.saturating_sub(first as u32);
        let mut params = self.clone();
        if let Some(at) = &mut params.animal_at {
            at.frame = counted(at.frame);
        }
        if let Some(head) = &mut params.head {
            head.frame = counted(head.frame);
        }
        params
    }

    /// Returns the parameters for the footage at `scale` times its size, as far as they concern its scene.
    pub(in crate::analysis) fn scaled(&self, scale: f64) -> Params {
        let mut params = self.clone();
        if let Some(at) = &mut params.animal_at {
            at.at_px = at.at_px.map(|v| v * scale);
        }
        for ignore in &mut params.ignore {
            let [x, y, w, h] = ignore.box_px;
            let rect =
                Rect::from_edges(x, y, x.saturating_add(w), y.saturating_add(h)).scaled(scale);
            ignore.box_px = [rect.x, rect.y, rect.w, rect.h];
        }
        params
    }

    /// Returns the boxes to ignore at a time, clipped to an image of the given size.
    pub fn ignored_at(&self, time_s: f64, [width, height]: [u32; 2]) -> Vec<Rect> {
        let holds = |ignore: &&IgnoreParam| {
            ignore.from_s.is_none_or(|from_s| from_s <= time_s)
                && ignore.to_s.is_none_or(|to_s| time_s <= to_s)
        };
        let clipped = |ignore: &IgnoreParam| {
            let [x, y, w, h] = ignore.box_px.map(i64::from);
            Rect::clipped(x, y, x + w, y + h, width, height)
        };
        self.ignore.iter().filter(holds).map(clipped).collect()
    }

    /// Checks that time spans are not empty and that boxes have pixels.
    pub(super) fn check_hints(&self) -> Result<(), String> {
        check_span("", self.from_s, self.to_s)?;
        for ignore in &self.ignore {
            check_span("ignore.", ignore.from_s, ignore.to_s)?;
            let [x, y, w, h] = ignore.box_px;
            if w == 0 || h == 0 {
                return Err(format!(
                    "ignore.box_px must contain at least one pixel: {x},{y},{w},{h}"
                ));
            }
        }
        Ok(())
    }
}

/// Checks that a time span is not empty.
fn check_span(name: &str, from_s: Option<f64>, to_s: Option<f64>) -> Result<(), String> {
    match (from_s.unwrap_or(0.0), to_s) {
        (from_s, Some(to_s)) if from_s >= to_s => Err(format!(
            "{name}from_s must be at least 0 and before {name}to_s: {from_s}"
        )),
        _ => Ok(()),
    }
}
