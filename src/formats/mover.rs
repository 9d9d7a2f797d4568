//! Moving objects other than the animal, in poses.json (docs/reference/formats.md, "poses.json").

use serde::{Deserialize, Serialize};

use crate::geometry::{Rect, rounded};
use crate::library::{Mover, MoverKind};

#[derive(Serialize, Deserialize)]
pub(super) struct MoverFile {
    kind: MoverName,
    from_s: f64,
    to_s: f64,
    box_px: [u32; 4],
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum MoverName {
    Animal,
    MirrorImage,
    FromBorder,
    InPlace,
    Other,
}

impl MoverFile {
    pub(super) fn of(mover: &Mover) -> MoverFile {
        MoverFile {
            kind: match mover.kind {
                MoverKind::Animal => MoverName::Animal,
                MoverKind::MirrorImage => MoverName::MirrorImage,
                MoverKind::FromBorder => MoverName::FromBorder,
                MoverKind::InPlace => MoverName::InPlace,
                MoverKind::Other => MoverName::Other,
            },
            from_s: rounded(mover.from_s, 3),
            to_s: rounded(mover.to_s, 3),
            box_px: [
                mover.box_px.x,
                mover.box_px.y,
                mover.box_px.w,
                mover.box_px.h,
            ],
        }
    }

    pub(super) fn into_mover(self) -> Mover {
        let [x, y, w, h] = self.box_px;
        Mover {
            kind: match self.kind {
                MoverName::Animal => MoverKind::Animal,
                MoverName::MirrorImage => MoverKind::MirrorImage,
                MoverName::FromBorder => MoverKind::FromBorder,
                MoverName::InPlace => MoverKind::InPlace,
                MoverName::Other => MoverKind::Other,
            },
            from_s: self.from_s,
            to_s: self.to_s,
            box_px: Rect { x, y, w, h },
        }
    }
}
