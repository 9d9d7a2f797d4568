//! `flockreel flock`: plans and films a flock from a library (docs/reference/command-line.md).
//!
//! It writes the film and, if requested, the plan (flock.json), a chart of the plan, and the ground truth. An
//! existing plan can be filmed again.

mod outputs; // flags about the film

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

use self::outputs::Outputs;
use super::{Error, Listener, Summary, set};
use crate::jobs::flock::film::Film;
use crate::media::{self, Tool};
use flockreel_core::flock::advice::Advice;
use flockreel_core::flock::{Flock, Params, plan_flock};
use flockreel_core::formats::{flock_json, params, svg};
use flockreel_core::library::Library;

/// Arguments of `flock`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    library: PathBuf,
    #[command(flatten)]
    outputs: Outputs,
    #[arg(long, help = set::parameter_help::<Params>("count"))]
    count: Option<u32>,
    #[arg(long, value_name = "BL", value_parser = set::finite, help = set::parameter_help::<Params>("spacing_bl"))]
    spacing: Option<f64>,
    #[arg(long, help = set::parameter_help::<Params>("frames"))]
    frames: Option<u32>,
    #[arg(long, help = set::parameter_help::<Params>("seed"))]
    seed: Option<u64>,
    /// Make a loop: the last frame leads into the first, so that the film repeats without a visible cut. A
    /// loop has 30 to 5000 frames. Use at least 10 seconds, so that the individuals have time to return.
    #[arg(long = "loop")]
    is_loop: bool,
    #[arg(long, help = set::presets_help::<Params>())]
    preset: Option<String>,
    /// Steering rules of the boids to override, as JSON: '{"alignment": 2, "cohesion_bl": 8}'.
    #[arg(long, value_name = "JSON")]
    rules: Option<String>,
    #[arg(long, value_name = "NAME=JSON", help = set::help("rules.wander=0.5"))]
    set: Vec<String>,
    /// Also write the plan to this file (the format of flock.json).
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Also write a chart of the headings of boids and individuals to this SVG file.
    #[arg(long, value_name = "SVG")]
    plan_picture: Option<PathBuf>,
    /// Draw the flock of this plan, a flock.json of the same library, instead of planning a new one.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["is_loop", "count", "spacing", "frames", "seed", "preset", "rules", "set"])]
    from: Option<PathBuf>,
}

/// Plans and films a flock.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let params = args.params()?;
    let background = args.outputs.open_background()?;
    let targets = args.outputs.targets(&params.render)?;
    media::search_in_background(&[Tool::Ffmpeg]);
    let library = super::read_library(&args.library, &args.outputs.output)?.library;
    let progress = Listener::new();
    let flock = match &args.from {
        Some(path) => {
            let mut flock = read_plan(path, &library)?;
            flock.params.render = params.render;
            flock
        }
        None => plan_flock(&library, &params, &progress)
            .map_err(|error| Error::work(error.code(), &error))?,
    };
    if let Some(path) = &args.plan {
        write_plan(&flock, path)
            .map_err(Error::io(format!("writing the plan: {}", path.display())))?;
    }
    if let Some(path) = &args.plan_picture {
        super::write_file(path, svg::plan(&flock))?;
    }
    for advice in Advice::all(&flock) {
        super::say(&format!("{advice} ({})", advice.code()));
    }
    let film = Film {
        library: &library,
        flock: &flock,
        backdrop: background.backdrop(),
        progress: &progress,
    };
    let start = Instant::now();
    film.make(&targets, args.outputs.ground_truth.as_deref())?;
    Ok(Some(summary(&args, &flock, start.elapsed())))
}

fn write_plan(flock: &Flock, path: &Path) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    flock_json::write_to(flock, &mut file)?;
    file.flush()
}

fn summary(args: &Args, flock: &Flock, rendered: Duration) -> Summary {
    Summary(json!({
        "video": args.outputs.output,
        "plan": args.plan,
        "plan_picture": args.plan_picture,
        "ground_truth": args.outputs.ground_truth,
        "count": flock.individuals.len(),
        "frames": flock.params.frames,
        "seed": flock.params.seed,
        "rendered_s": (rendered.as_secs_f64() * 1e3).round() / 1e3,
        "heading_error_median_rad": flock.stats.heading_error_median_rad,
        "jumps_per_100_frames": flock.stats.jumps_per_100_frames,
        "clone_share": flock.stats.clone_share,
        "room_for": flock.stats.room_for,
    }))
}

/// Reads an existing plan. Fails if it belongs to another library.
pub(super) fn read_plan(path: &Path, library: &Library) -> Result<Flock, Error> {
    let refused = |why: &str| Error::Usage(format!("{why}: {}", path.display()));
    let bytes = std::fs::read(path)
        .map_err(|cause| refused(&format!("the plan cannot be read: {cause}")))?;
    let flock =
        flock_json::read(&bytes).map_err(|cause| refused(&format!("not a flock.json: {cause}")))?;
    if !flock.fits(library) {
        return Err(refused("the plan belongs to another library"));
    }
    Ok(flock)
}

impl Args {
    /// Returns the preset with the parameters set by flags.
    fn params(&self) -> Result<Params, Error> {
        let mut overrides = Map::new();
        if let Some(text) = &self.rules {
            let rules = serde_json::from_str(text)
                .map_err(|cause| Error::Usage(format!("--rules is not JSON: {cause}")))?;
            overrides.insert("rules".into(), rules);
        }
        let render = Value::Object(self.outputs.overrides());
        overrides.insert("render".into(), render);
        let given = [
            ("loop", self.is_loop.then_some(Value::Bool(true))),
            ("preset", self.preset.clone().map(Value::from)),
            ("count", self.count.map(Value::from)),
            ("spacing_bl", self.spacing.map(Value::from)),
            ("frames", self.frames.map(Value::from)),
            ("seed", self.seed.map(Value::from)),
        ];
        for (name, value) in given {
            overrides.extend(value.map(|value| (name.to_owned(), value)));
        }
        set::apply(&self.set, &mut overrides)?;
        params::read(overrides).map_err(|error| Error::Usage(error.to_string()))
    }
}
