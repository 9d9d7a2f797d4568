//! Moving objects other than the animal, in poses.json (docs/reference/formats.md, "poses.json").

use serde::{Deserialize, Serialize};

use crate::geometry::{Rect, rounded};
use crate::library::{Mover, MoverKind};

#[derive(Serialize, Deserialize)]
pub(super) struct MoverFile {
    #[serde(with = "MoverName")]
    kind: MoverKind,
    from_s: f64,
    to_s: f64,
    box_px: [u32; 4],
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "MoverKind", rename_all = "snake_case")]
enum MoverName {
    Animal,
    MirrorImage,
    FromBorder,
    InPlace,
    Other,
}

impl MoverFile {
    pub(super) fn new(mover: &Mover) -> MoverFile {
        let Rect { x, y, w, h } = mover.box_px;
        MoverFile {
            kind: mover.kind,
            from_s: rounded(mover.from_s, 3),
            to_s: rounded(mover.to_s, 3),
            box_px: [x, y, w, h],
        }
    }

    pub(super) fn into_mover(self) -> Mover {
        let [x, y, w, h] = self.box_px;
        Mover {
            kind: self.kind,
            from_s: self.from_s,
            to_s: self.to_s,
            box_px: Rect { x, y, w, h },
        }
    }
}
