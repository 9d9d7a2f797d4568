//! flock.plan: the positions and frames of a flock as binary columns, a tenth of the size of flock.json
//! (docs/reference/formats.md, "flock.plan"). Browsers and game engines draw a flock from it and the atlas.
//!
//! A head in JSON lists the columns. Each column holds integers of the smallest type that fits; a value is
//! an integer times the scale of its column. The values are those of flock.json, digit for digit.

use serde::Serialize;
use serde_json::Value;

use super::flock_json;
use crate::flock::individual::Fade;
use crate::flock::{Flock, Individual};

/// Name and version of the schema.
pub const SCHEMA: &str = "flockreel/plan@1";
/// Media type for the `Accept` and `Content-Type` headers.
pub const MEDIA_TYPE: &str = "application/vnd.flockreel.plan";
/// First bytes of every file.
const MAGIC: &[u8; 8] = b"FLOCKPLN";
/// Version of the binary layout.
const VERSION: u32 = 1;

/// Returns the flock as bytes.
pub fn write(flock: &Flock) -> Vec<u8> {
    let mut columns = Columns::default();
    let n_frames = flock.params.frames as usize;
    let mut cells = |name, scale, of: &dyn Fn(&Individual, usize) -> f64| {
        let all = flock.individuals.iter();
        let values = all.flat_map(|one| (0..n_frames).map(move |t| of(one, t)));
        columns.add(name, scale, values);
    };
    cells("source_frame", 1.0, &|one, t| one.source_frame[t].into());
    cells("mirrored", 1.0, &|one, t| one.mirrored[t].into());
    cells("x", 1e-2, &|one, t| one.centroid_px[t][0]);
    cells("y", 1e-2, &|one, t| one.centroid_px[t][1]);
    cells("rotation", 1e-5, &|one, t| one.rotation_rad[t]);
    cells("scale", 1e-4, &|one, t| one.scale[t]);
    cells("depth", 1e-2, &|one, t| one.boid.position_px[t][2]);
    cells("state", 1.0, &|one, t| {
        let state = one.state.get(t);
        state.map_or(0.0, |&state| f64::from(state as u8))
    });
    let fades = || flock.individuals.iter().flat_map(|one| &one.fades);
    let sources = fades().flat_map(|fade| &fade.source_frame);
    columns.add("fade_source_frame", 1.0, sources.map(|&frame| frame.into()));
    let rotations = fades().flat_map(|fade| fade.rotation_rad.iter().copied());
    columns.add("fade_rotation", 1e-5, rotations);
    let scales = fades().flat_map(|fade| fade.scale.iter().copied());
    columns.add("fade_scale", 1e-4, scales);
    let weights = fades().flat_map(|fade| fade.weight.iter().copied());
    columns.add("fade_weight", 1e-4, weights);
    assemble(&head(flock, columns.table), &columns.bytes)
}

#[derive(Serialize)]
struct Head<'a> {
    schema: &'static str,
    version: &'static str,
    params: &'a crate::flock::Params,
    seed: u64,
    fps: f64,
    image_size_px: [u32; 2],
    length_px: f64,
    stats: Value,
    n_frames: u32,
    n_individuals: usize,
    individuals: Vec<IndividualHead>,
    predator: &'a [[f64; 3]],
    fades: Vec<FadeHead>,
    columns: Vec<Column>,
}

#[derive(Serialize)]
struct IndividualHead {
    id: u32,
    size: f64,
}

#[derive(Serialize)]
struct FadeHead {
    individual: usize,
    start: u32,
    n: usize,
    mirrored: bool,
}

/// A column in the head of the file.
#[derive(Serialize)]
struct Column {
    name: &'static str,
    r#type: &'static str,
    scale: f64,
    n: usize,
    /// Offset of the first value from the end of the head, bytes.
    at: usize,
}

fn head(flock: &Flock, columns: Vec<Column>) -> Vec<u8> {
    let of_individual = |(individual, one): (usize, &Individual)| {
        let head = move |fade: &Fade| FadeHead {
            individual,
            start: fade.start,
            n: fade.source_frame.len(),
            mirrored: fade.mirrored,
        };
        one.fades.iter().map(head).collect::<Vec<_>>()
    };
    let head = Head {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        params: &flock.params,
        seed: flock.params.seed,
        fps: flock.fps,
        image_size_px: flock.image_size_px,
        length_px: flock.length_px,
        stats: flock_json::stats(flock),
        n_frames: flock.params.frames,
        n_individuals: flock.individuals.len(),
        individuals: (flock.individuals.iter())
            .map(|one| IndividualHead {
                id: one.id,
                size: one.size,
            })
            .collect(),
        predator: &flock.predator_px,
        fades: (flock.individuals.iter().enumerate())
            .flat_map(of_individual)
            .collect(),
        columns,
    };
    serde_json::to_vec(&head).expect("plain values serialize")
}

fn assemble(head: &[u8], columns: &[u8]) -> Vec<u8> {
    let n_head = head.len().next_multiple_of(4);
    let mut bytes = Vec::with_capacity(16 + n_head + columns.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&(n_head as u32).to_le_bytes());
    bytes.extend_from_slice(head);
    bytes.resize(16 + n_head, b' ');
    bytes.extend_from_slice(columns);
    bytes
}

#[derive(Default)]
struct Columns {
    table: Vec<Column>,
    bytes: Vec<u8>,
}

impl Columns {
    /// Adds a column whose values are multiples of `scale`.
    fn add(&mut self, name: &'static str, scale: f64, values: impl Iterator<Item = f64>) {
        let integers = values.map(|value| (value / scale).round() as i64);
        let integers: Vec<i64> = integers.collect();
        let least = integers.iter().copied().min().unwrap_or(0);
        let most = integers.iter().copied().max().unwrap_or(0);
        let fits = |low: i64, high: i64| least >= low && most <= high;
        let (r#type, n_bytes) = if fits(0, u8::MAX.into()) {
            ("u8", 1)
        } else if fits(i8::MIN.into(), i8::MAX.into()) {
            ("i8", 1)
        } else if fits(0, u16::MAX.into()) {
            ("u16", 2)
        } else if fits(i16::MIN.into(), i16::MAX.into()) {
            ("i16", 2)
        } else if fits(0, u32::MAX.into()) {
            ("u32", 4)
        } else {
            ("i32", 4)
        };
        self.table.push(Column {
            name,
            r#type,
            scale,
            n: integers.len(),
            at: self.bytes.len(),
        });
        for integer in integers {
            self.bytes
                .extend_from_slice(&integer.to_le_bytes()[..n_bytes]);
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    /// Reads a column by the rules of docs/reference/formats.md.
    fn column(bytes: &[u8], head: &Value, name: &str) -> Vec<f64> {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let columns = head["columns"].as_array().unwrap();
        let entry = columns.iter().find(|one| one["name"] == name).unwrap();
        let whole = |key: &str| entry[key].as_u64().unwrap() as usize;
        let kind = entry["type"].as_str().unwrap();
        let n_bytes = kind[1..].parse::<usize>().unwrap() / 8;
        let from = 16 + number(12) as usize + whole("at");
        assert_eq!(from % 4, 0);
        let cells = bytes[from..][..whole("n") * n_bytes].chunks_exact(n_bytes);
        let value = |cell: &[u8]| {
            let negative = kind.starts_with('i') && cell[n_bytes - 1] >= 128;
            let mut wide = if negative { [255; 8] } else { [0; 8] };
            wide[..n_bytes].copy_from_slice(cell);
            i64::from_le_bytes(wide) as f64 * entry["scale"].as_f64().unwrap()
        };
        cells.map(value).collect()
    }

    #[test]
    fn columns_hold_the_values_of_flock_json() {
        let params = Params {
            count: Some(3),
            frames: 90,
            ..Params::default()
        };
        let flock = plan_flock(&synthetic::library(View::Side), &params, &Silent).unwrap();
        let bytes = write(&flock);
        assert_eq!(&bytes[..8], MAGIC);
        let n_head = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let head: Value = serde_json::from_slice(&bytes[16..16 + n_head]).unwrap();
        assert_eq!(
            (&head["n_individuals"], &head["n_frames"]),
            (&3.into(), &90.into())
        );
        let close = |name: &str, of: &dyn Fn(&Individual, usize) -> f64| {
            let values = column(&bytes, &head, name);
            assert_eq!(values.len(), 270, "{name}");
            for (k, one) in flock.individuals.iter().enumerate() {
                for t in 0..90 {
                    let (stored, value) = (values[k * 90 + t], of(one, t));
                    assert!(
                        (stored - value).abs() < 1e-9,
                        "{name} {k} {t}: {stored} {value}"
                    );
                }
            }
        };
        close("source_frame", &|one, t| one.source_frame[t].into());
        close("x", &|one, t| one.centroid_px[t][0]);
        close("y", &|one, t| one.centroid_px[t][1]);
        close("rotation", &|one, t| one.rotation_rad[t]);
        close("scale", &|one, t| one.scale[t]);
        close("depth", &|one, t| one.boid.position_px[t][2]);
        let weights: Vec<f64> = (flock.individuals.iter().flat_map(|one| &one.fades))
            .flat_map(|fade| fade.weight.clone())
            .collect();
        assert!(!weights.is_empty());
        let stored = column(&bytes, &head, "fade_weight");
        assert!(
            stored
                .iter()
                .zip(&weights)
                .all(|(a, b)| (a - b).abs() < 1e-9)
        );
        assert_eq!(stored.len(), weights.len());
    }
}
