//! library.json: the playback graph and the statistics of a library (docs/reference/formats.md,
//! "library.json").
//!
//! Poses, background and mattes are separate files; `library_dir` combines them.

use serde::{Deserialize, Serialize};

mod disturbance;

use self::disturbance::DisturbanceFile;
use crate::analysis::Params;
use crate::analysis::stats::{Advice, advice};
use crate::geometry::rounded;
use crate::library::{Jump, Library, LibraryStats, Patch, Playback, Shadow, Transition};

/// Name and version of the schema.
pub const SCHEMA: &str = "flockreel/library@2";

/// The footage from which a library was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FootageSummary {
    /// SHA-256 of the file, or of the concatenated pictures of a folder, hexadecimal.
    pub sha256: String,
    /// Size of the file, or of all those pictures, bytes.
    pub n_bytes: u64,
}

/// The contents of library.json.
pub struct Summary {
    /// The footage from which the library was made.
    pub footage: FootageSummary,
    /// Parameters of the analysis.
    pub params: Params,
    /// Width and height of the sprites, pixels.
    pub sprite_size_px: [u32; 2],
    /// Scale of each frame's sprite relative to the footage; `None` if all are 1.
    pub sprite_scale: Option<Vec<f64>>,
    /// Centroid in each frame's matte, pixels; empty in older files, which have sprites instead of mattes.
    pub matte_center_px: Vec<Option<[f64; 2]>>,
    /// Whether occluders.png exists, with objects in front of the animal.
    pub occluders: bool,
    /// The shadow of the animal.
    pub shadow: Option<Shadow>,
    /// Number of sprites in a clip.
    pub clip_frames: usize,
    /// Distance below which two clips are similar.
    pub epsilon: u64,
    /// Median of D(i, i+1).
    pub natural_step: u64,
    /// Pairs of similar clips.
    pub transitions: Vec<Transition>,
    /// Jumps and component of the playback graph.
    pub playback: Playback,
    /// Runs of sprites between jump ends.
    pub patches: Vec<Patch>,
    /// Statistics.
    pub stats: LibraryStats,
}

/// Returns the JSON of a library.
pub fn write(library: &Library, params: &Params, footage: &FootageSummary) -> Vec<u8> {
    let file = LibraryFile {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        params: Some(params.clone()),
        footage: footage.clone(),
        sprite_size_px: [library.sprites.width(), library.sprites.height()],
        sprite_scale: library.sprites.scales().map(<[f64]>::to_vec),
        matte_center_px: (0..library.sprites.n_frames())
            .map(|idx| library.sprites.matte(idx).map(|matte| matte.center_px))
            .collect(),
        occluders: library.occluders.is_some(),
        shadow: library.shadow.as_ref().map(ShadowFile::new),
        clip_frames: library.clip_frames,
        epsilon: library.epsilon,
        natural_step: library.natural_step,
        stats: StatsFile::new(&library.stats, &advice(library, params)),
        transitions: library
            .transitions
            .iter()
            .map(TransitionFile::new)
            .collect(),
        playback: library.playback.jumps.iter().map(JumpFile::new).collect(),
        component: library.playback.component.clone(),
        patches: library
            .patches
            .iter()
            .enumerate()
            .map(|(id, p)| PatchFile::new(id, p))
            .collect(),
    };
    serde_json::to_vec(&file).expect("plain values serialise")
}

/// Parses the output of `write`.
pub fn read(bytes: &[u8]) -> Result<Summary, serde_json::Error> {
    let file: LibraryFile = serde_json::from_slice(bytes)?;
    Ok(Summary {
        footage: file.footage,
        params: file.params.unwrap_or_default(),
        sprite_size_px: file.sprite_size_px,
        sprite_scale: file.sprite_scale,
        matte_center_px: file.matte_center_px,
        occluders: file.occluders,
        shadow: file.shadow.map(|shadow| shadow.0),
        clip_frames: file.clip_frames,
        epsilon: file.epsilon,
        natural_step: file.natural_step,
        transitions: file.transitions.into_iter().map(|file| file.0).collect(),
        playback: Playback {
            jumps: file.playback.into_iter().map(JumpFile::into_jump).collect(),
            component: file.component,
        },
        patches: file
            .patches
            .into_iter()
            .map(PatchFile::into_patch)
            .collect(),
        stats: file.stats.into_stats(),
    })
}

#[derive(Serialize, Deserialize)]
struct LibraryFile {
    schema: String,
    version: String,
    #[serde(deserialize_with = "super::params::of_any_version")]
    params: Option<Params>,
    footage: FootageSummary,
    sprite_size_px: [u32; 2],
    /// Absent in older files.
    #[serde(default)]
    sprite_scale: Option<Vec<f64>>,
    /// Absent in older files.
    #[serde(default)]
    matte_center_px: Vec<Option<[f64; 2]>>,
    /// Absent in older files.
    #[serde(default)]
    occluders: bool,
    /// Absent in older files.
    #[serde(default)]
    shadow: Option<ShadowFile>,
    clip_frames: usize,
    epsilon: u64,
    natural_step: u64,
    stats: StatsFile,
    transitions: Vec<TransitionFile>,
    playback: Vec<JumpFile>,
    component: Vec<u32>,
    patches: Vec<PatchFile>,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct ShadowFile(#[serde(with = "ShadowFields")] Shadow);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Shadow")]
struct ShadowFields {
    darkness: f64,
    offset_bl: [f64; 2],
    blur_bl: f64,
}

impl ShadowFile {
    fn new(shadow: &Shadow) -> ShadowFile {
        let round = |value| rounded(value, 4);
        ShadowFile(Shadow {
            darkness: round(shadow.darkness),
            offset_bl: shadow.offset_bl.map(round),
            blur_bl: round(shadow.blur_bl),
        })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct TransitionFile(#[serde(with = "TransitionFields")] Transition);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Transition")]
struct TransitionFields {
    from: u32,
    to: u32,
    mirrored: bool,
    distance: u64,
    heading_gap_rad: f64,
}

impl TransitionFile {
    fn new(transition: &Transition) -> TransitionFile {
        TransitionFile(Transition {
            heading_gap_rad: rounded(transition.heading_gap_rad, 5),
            ..*transition
        })
    }
}

/// [frame, next frame, cost], or [frame, next frame, cost, true] if the mirror side changes.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum JumpFile {
    Same(u32, u32, u64),
    Mirrored(u32, u32, u64, bool),
}

impl JumpFile {
    fn new(jump: &Jump) -> JumpFile {
        if jump.mirrored {
            JumpFile::Mirrored(jump.from, jump.to, jump.cost, true)
        } else {
            JumpFile::Same(jump.from, jump.to, jump.cost)
        }
    }

    fn into_jump(self) -> Jump {
        let (from, to, cost, mirrored) = match self {
            JumpFile::Same(from, to, cost) => (from, to, cost, false),
            JumpFile::Mirrored(from, to, cost, mirrored) => (from, to, cost, mirrored),
        };
        Jump {
            from,
            to,
            cost,
            mirrored,
        }
    }
}

/// Frames `start..end`; `end` is exclusive.
#[derive(Serialize, Deserialize)]
struct PatchFile {
    id: usize,
    start: u32,
    end: u32,
    next: Vec<u32>,
}

impl PatchFile {
    fn new(id: usize, patch: &Patch) -> PatchFile {
        let next = patch.next.clone();
        PatchFile {
            id,
            start: patch.frames.start,
            end: patch.frames.end,
            next,
        }
    }

    fn into_patch(self) -> Patch {
        Patch {
            frames: self.start..self.end,
            next: self.next,
        }
    }
}

#[derive(Serialize, Deserialize)]
struct StatsFile {
    n_frames: usize,
    n_detected: usize,
    background: BackgroundStats,
    #[serde(default)]
    several_animals: bool,
    #[serde(default)]
    n_foreign_frames: usize,
    #[serde(default)]
    first_foreign_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    disturbances: Vec<DisturbanceFile>,
    #[serde(default)]
    animal_too_small: bool,
    n_candidates: u64,
    n_transitions: usize,
    kappa_used: Option<f64>,
    component_share: f64,
    heading_histogram: Vec<u32>,
    speed_bl_per_s: Option<[f64; 3]>,
    turn_rate_rad_per_s: Option<f64>,
    length_px: Option<f64>,
    /// For readers of the file. It is not read back, because it is computed from the library.
    #[serde(default, skip_deserializing)]
    advice: Vec<AdviceFile>,
}

#[derive(Serialize, Deserialize)]
struct BackgroundStats {
    never_seen_px: u64,
    /// Absent from the files of older versions.
    #[serde(default)]
    still_px: u64,
}

#[derive(Serialize)]
struct AdviceFile {
    code: &'static str,
    sentence: String,
}

impl AdviceFile {
    fn new(advice: &Advice) -> AdviceFile {
        AdviceFile {
            code: advice.code(),
            sentence: advice.to_string(),
        }
    }
}

impl StatsFile {
    fn new(stats: &LibraryStats, advice: &[Advice]) -> StatsFile {
        let decimals = |n: i32| move |value: f64| rounded(value, n);
        StatsFile {
            n_frames: stats.n_frames,
            n_detected: stats.n_detected,
            background: BackgroundStats {
                never_seen_px: stats.never_seen_px,
                still_px: stats.still_px,
            },
            several_animals: stats.several_animals,
            n_foreign_frames: stats.n_foreign_frames,
            first_foreign_s: stats.first_foreign_s.map(decimals(3)),
            disturbances: stats
                .disturbances
                .iter()
                .map(DisturbanceFile::new)
                .collect(),
            animal_too_small: stats.animal_too_small,
            n_candidates: stats.n_candidates,
            n_transitions: stats.n_transitions,
            kappa_used: stats.kappa_used,
            component_share: decimals(5)(stats.component_share),
            heading_histogram: stats.heading_histogram.clone(),
            speed_bl_per_s: stats.speed_bl_per_s.map(|s| s.map(decimals(4))),
            turn_rate_rad_per_s: stats.turn_rate_rad_per_s.map(decimals(4)),
            length_px: stats.length_px.map(decimals(3)),
            advice: advice.iter().map(AdviceFile::new).collect(),
        }
    }

    fn into_stats(self) -> LibraryStats {
        LibraryStats {
            n_frames: self.n_frames,
            n_detected: self.n_detected,
            never_seen_px: self.background.never_seen_px,
            still_px: self.background.still_px,
            several_animals: self.several_animals,
            n_foreign_frames: self.n_foreign_frames,
            first_foreign_s: self.first_foreign_s,
            disturbances: (self.disturbances.into_iter())
                .map(DisturbanceFile::into_disturbance)
                .collect(),
            animal_too_small: self.animal_too_small,
            n_candidates: self.n_candidates,
            n_transitions: self.n_transitions,
            kappa_used: self.kappa_used,
            component_share: self.component_share,
            heading_histogram: self.heading_histogram,
            speed_bl_per_s: self.speed_bl_per_s,
            turn_rate_rad_per_s: self.turn_rate_rad_per_s,
            length_px: self.length_px,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::synthetic;
    use crate::library::View;

    #[test]
    fn advice_is_written_and_optional_when_read() {
        let mut library = synthetic::library(View::Side);
        library.playback.jumps.clear();
        let footage = FootageSummary {
            sha256: "ab".into(),
            n_bytes: 9,
        };
        let bytes = write(&library, &Params::default(), &footage);
        let mut file: serde_json::Value = serde_json::from_slice(&bytes).expect("JSON");
        assert_eq!(file["stats"]["advice"][0]["code"], "no_transitions");
        let stats = file["stats"].as_object_mut().expect("an object");
        stats.remove("advice").expect("just seen");
        file["params"]["approximate"] = true.into();
        let older = serde_json::to_vec(&file).expect("JSON");
        assert_eq!(
            read(&older).expect("a library").stats,
            read(&bytes).expect("a library").stats
        );
    }
}
