//! flock.json: all data of a flock except its pixels (docs/reference/formats.md, "flock.json").
//!
//! A flock holds rounded numbers, so reading returns exactly what was written. Each plan's cost can be
//! recomputed from this file and the library (docs/explanation/algorithms.md, "Planning").

mod limits; // of the numbers in a file
mod space; // the tank and how it is seen
mod stats; // quality of the flock, and its order in every frame

use std::io::{self, Write};

use serde::de::Error as _;
use serde::{Deserialize, Serialize};

use self::space::SpaceFile;
use self::stats::StatsFile;
use crate::flock::individual::MotionState;
use crate::flock::{BoidTrack, Fade, Flock, Individual, Params, PlanCost};
use crate::parameters::Parameters;

/// Name and version of the schema.
pub const SCHEMA: &str = "flockreel/flock@3";

/// Returns the flock as JSON, one line per individual.
pub fn write(flock: &Flock) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_to(flock, &mut bytes).expect("memory takes all bytes");
    bytes
}

/// Writes the flock as JSON, piece by piece, because a long film has hundreds of megabytes. `out` should be
/// buffered.
pub fn write_to(flock: &Flock, out: &mut impl Write) -> io::Result<()> {
    let file = FlockFile {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        params: flock.params.clone(),
        seed: flock.params.seed,
        fps: flock.fps,
        image_size_px: flock.image_size_px,
        length_px: flock.length_px,
        space: Some(SpaceFile::new(&flock.space)),
        stats: StatsFile::new(flock.stats, &flock.orders),
        predator: flock.predator_px.clone(),
        individuals: (), // written line by line below
    };
    let head = serde_json::to_string(&file).expect("plain values serialise");
    let head = head.strip_suffix("null}").expect("individuals come last");
    out.write_all(head.as_bytes())?;
    for (idx, individual) in flock.individuals.iter().enumerate() {
        out.write_all(if idx == 0 { b"[\n" } else { b",\n" })?;
        serde_json::to_writer(&mut *out, &IndividualFile::new(individual))?;
    }
    out.write_all(b"\n]}\n")
}

/// Returns `stats` of flock.json.
pub(super) fn stats(flock: &Flock) -> serde_json::Value {
    let file = StatsFile::new(flock.stats, &flock.orders);
    serde_json::to_value(file).expect("plain values serialise")
}

/// Parses the output of `write`. Fails if a number is beyond what a flock can have.
pub fn read(bytes: &[u8]) -> Result<Flock, serde_json::Error> {
    let file: FlockFile<Vec<IndividualFile>> = serde_json::from_slice(bytes)?;
    let flock = Flock {
        fps: file.fps,
        image_size_px: file.image_size_px,
        length_px: file.length_px,
        space: SpaceFile::into_space(file.space, file.length_px),
        params: file.params,
        predator_px: file.predator,
        individuals: file
            .individuals
            .into_iter()
            .map(IndividualFile::into_individual)
            .collect(),
        orders: file.stats.orders()?,
        stats: file.stats.stats,
    };
    let checked = limits::check(&flock).and_then(|()| flock.params.check());
    checked.map(|()| flock).map_err(serde_json::Error::custom)
}

#[derive(Serialize, Deserialize)]
struct FlockFile<Individuals> {
    schema: String,
    version: String,
    params: Params,
    seed: u64,
    fps: f64,
    image_size_px: [u32; 2],
    length_px: f64,
    /// Absent in older files.
    #[serde(default)]
    space: Option<SpaceFile>,
    stats: StatsFile,
    /// Absent in older files.
    #[serde(default)]
    predator: Vec<[f64; 3]>,
    individuals: Individuals,
}

#[derive(Serialize, Deserialize)]
struct IndividualFile {
    id: u32,
    source_frame: Vec<u32>,
    mirrored: Vec<bool>,
    rotation_rad: Vec<f64>,
    /// Absent in older files.
    #[serde(default)]
    continues_as: Option<u32>,
    /// Absent in schema 1.
    #[serde(default)]
    variation: VariationFile,
    /// Absent in schema 1.
    #[serde(default)]
    state: Vec<MotionState>,
    /// Absent before schema 3.
    #[serde(default)]
    carried: Vec<bool>,
    fade: Vec<FadeFile>,
    centroid_px: Vec<[f64; 2]>,
    heading_rad: Vec<f64>,
    forward: Option<Vec<[f64; 3]>>,
    scale: Vec<f64>,
    depth_m: Option<Vec<f64>>,
    #[serde(with = "BoidFields")]
    boid: BoidTrack,
    cost: CostFile,
}

/// Differences between an individual and the filmed animal.
#[derive(Serialize, Deserialize)]
struct VariationFile {
    size: f64,
}

impl Default for VariationFile {
    fn default() -> VariationFile {
        VariationFile { size: 1.0 }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct FadeFile(#[serde(with = "FadeFields")] Fade);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Fade")]
struct FadeFields {
    start: u32,
    source_frame: Vec<u32>,
    mirrored: bool,
    rotation_rad: Vec<f64>,
    scale: Vec<f64>,
    weight: Vec<f64>,
}

/// `position`: x, y and depth behind the front of the tank, pixels; `speed`: body lengths per second.
#[derive(Serialize, Deserialize)]
#[serde(remote = "BoidTrack")]
struct BoidFields {
    #[serde(rename = "position")]
    position_px: Vec<[f64; 3]>,
    /// Absent in older files.
    #[serde(default)]
    forward: Option<Vec<[f64; 3]>>,
    heading_rad: Vec<f64>,
    #[serde(rename = "speed")]
    speed_bl_per_s: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct CostFile(#[serde(with = "CostFields")] PlanCost);

#[derive(Serialize, Deserialize)]
#[serde(remote = "PlanCost")]
struct CostFields {
    total: f64,
    heading: f64,
    speed: f64,
    transition: f64,
    crowd: f64,
    /// Absent in older files.
    #[serde(default)]
    repetition: f64,
    lower_bound: f64,
    exact: bool,
}

impl IndividualFile {
    fn new(individual: &Individual) -> IndividualFile {
        let individual = individual.clone();
        IndividualFile {
            id: individual.id,
            source_frame: individual.source_frame,
            mirrored: individual.mirrored,
            rotation_rad: individual.rotation_rad,
            continues_as: individual.continues_as,
            variation: VariationFile {
                size: individual.size,
            },
            state: individual.state,
            carried: individual.carried,
            fade: individual.fades.into_iter().map(FadeFile).collect(),
            centroid_px: individual.centroid_px,
            heading_rad: individual.heading_rad,
            forward: individual.forward,
            scale: individual.scale,
            depth_m: individual.depth_m,
            boid: individual.boid,
            cost: CostFile(individual.cost),
        }
    }

    fn into_individual(self) -> Individual {
        Individual {
            id: self.id,
            source_frame: self.source_frame,
            mirrored: self.mirrored,
            rotation_rad: self.rotation_rad,
            continues_as: self.continues_as,
            size: self.variation.size,
            state: self.state,
            carried: self.carried,
            fades: self.fade.into_iter().map(|fade| fade.0).collect(),
            centroid_px: self.centroid_px,
            heading_rad: self.heading_rad,
            forward: self.forward,
            scale: self.scale,
            depth_m: self.depth_m,
            boid: self.boid,
            cost: self.cost.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    #[test]
    fn flock_is_read_back_as_written() {
        let library = synthetic::library(View::Side);
        let params = Params {
            count: Some(3),
            frames: 40,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).unwrap();
        let bytes = write(&flock);
        assert_eq!(read(&bytes).unwrap(), flock);
        let head = String::from_utf8_lossy(&bytes[..60]).into_owned();
        assert!(head.starts_with(r#"{"schema":"flockreel/flock@3","version":""#));
    }

    #[test]
    fn measures_with_different_numbers_of_frames_are_refused() {
        let library = synthetic::library(View::Top);
        let params = Params {
            count: Some(2),
            frames: 5,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).unwrap();
        let text = String::from_utf8(write(&flock)).unwrap();
        let short = text.replacen(r#""groups":[1,"#, r#""groups":["#, 1);
        assert_ne!(short, text);
        let error = read(short.as_bytes()).unwrap_err();
        assert!(error.to_string().contains("stats.per_frame"), "{error}");
        // Older files have none.
        let (from, to) = (text.find(r#","per_frame""#), text.find(r#"},"predator""#));
        let (from, to) = (from.unwrap(), to.unwrap());
        let before = [&text[..from], &text[to..]].concat();
        assert!(read(before.as_bytes()).unwrap().orders.is_empty());
    }

    #[test]
    fn numbers_beyond_any_flock_are_refused_by_name() {
        let library = synthetic::library(View::Side);
        let params = Params {
            count: Some(1),
            frames: 3,
            ..Params::default()
        };
        let flock = plan_flock(&library, &params, &Silent).unwrap();
        let file: serde_json::Value = serde_json::from_slice(&write(&flock)).unwrap();
        for (pointer, value, sentence) in [
            ("/fps", 1e308, "fps is out of range"),
            ("/length_px", 0.0, "length_px is out of range"),
            ("/space/camera/focal_px", 0.0, "space is out of range"),
            (
                "/individuals/0/scale/1",
                1e308,
                "individuals is out of range",
            ),
            (
                "/individuals/0/centroid_px/2/0",
                -1e308,
                "individuals is out of range",
            ),
            (
                "/individuals/0/boid/speed/0",
                -1.0,
                "individuals is out of range",
            ),
            (
                "/individuals/0/cost/total",
                1e300,
                "individuals is out of range",
            ),
            ("/params/variation", 1e308, "variation must lie in"),
        ] {
            let mut file = file.clone();
            *file.pointer_mut(pointer).expect(pointer) = value.into();
            let error = read(file.to_string().as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(sentence), "{pointer}: {error}");
        }
    }
}
