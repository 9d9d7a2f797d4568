//! Times of another light or an unsteady camera, in library.json (docs/reference/formats.md, "library.json").

use serde::{Deserialize, Serialize};

use crate::geometry::rounded;
use crate::library::{Disturbance, DisturbanceKind};

#[derive(Serialize, Deserialize)]
pub(super) struct DisturbanceFile {
    #[serde(with = "DisturbanceName")]
    kind: DisturbanceKind,
    from_s: f64,
    to_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "DisturbanceKind", rename_all = "snake_case")]
enum DisturbanceName {
    Camera,
    Light,
}

impl DisturbanceFile {
    pub(super) fn new(disturbance: &Disturbance) -> DisturbanceFile {
        DisturbanceFile {
            kind: disturbance.kind,
            from_s: rounded(disturbance.from_s, 3),
            to_s: rounded(disturbance.to_s, 3),
        }
    }

    pub(super) fn into_disturbance(self) -> Disturbance {
        Disturbance {
            kind: self.kind,
            from_s: self.from_s,
            to_s: self.to_s,
        }
    }
}
