//! `flockreel flock`: library to flock (DESIGN.md, Command line), as a video and, when asked for, its
//! plan as flock.json.

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::{Error, Listener, Summary};
use crate::flock::{Params, plan_flock};
use crate::formats::{flock_json, params, svg};
use crate::jobs::flock::film::Film;

/// Arguments of `flock`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that `analyze` made.
    library: PathBuf,
    /// The video to make.
    #[arg(short, long, value_name = "VIDEO")]
    output: PathBuf,
    /// Individuals, 1 to 2000.
    #[arg(long)]
    count: Option<u32>,
    /// Frames, 1 to 10000.
    #[arg(long)]
    frames: Option<u32>,
    /// Everything random follows from it.
    #[arg(long)]
    seed: Option<u64>,
    /// Where to start from: school, swarm, mill, scatter or papers.
    #[arg(long)]
    preset: Option<String>,
    /// Rules to override, as JSON: '{"alignment": 2, "cohesion_bl": 8}'.
    #[arg(long, value_name = "JSON")]
    rules: Option<String>,
    /// What frames and boids are matched by: heading (the default) or position.
    #[arg(long = "match", value_name = "BY")]
    match_by: Option<String>,
    /// Write the plan, flock.json, here.
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Draw what the boids ask for against what is shown here, as SVG.
    #[arg(long, value_name = "SVG")]
    plan_picture: Option<PathBuf>,
    /// Write what is where in every frame into this folder: masks, coco.json, MOTChallenge, tracks.csv.
    #[arg(long, value_name = "DIR")]
    ground_truth: Option<PathBuf>,
}

/// Plans and films a flock.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let params = args.params()?;
    let library = super::read_library(&args.library, &args.output)?.library;
    let progress = Listener::new();
    let flock = plan_flock(&library, &params, &progress)
        .map_err(|error| Error::work(error.code(), &error))?;
    if let Some(path) = &args.plan {
        std::fs::write(path, flock_json::write(&flock))
            .map_err(Error::io(format!("writing the plan: {}", path.display())))?;
    }
    if let Some(path) = &args.plan_picture {
        std::fs::write(path, svg::plan(&flock)).map_err(Error::io(format!(
            "writing the picture: {}",
            path.display()
        )))?;
    }
    let film = Film {
        library: &library,
        flock: &flock,
        progress: &progress,
    };
    film.make(&args.output, args.ground_truth.as_deref())
        .map_err(|error| Error::work(error.code(), &error))?;
    Ok(Some(Summary(json!({
        "video": args.output,
        "plan": args.plan,
        "plan_picture": args.plan_picture,
        "ground_truth": args.ground_truth,
        "count": params.count,
        "frames": params.frames,
        "seed": params.seed,
        "heading_error_median_rad": flock.stats.heading_error_median_rad,
        "jumps_per_100_frames": flock.stats.jumps_per_100_frames,
        "clone_share": flock.stats.clone_share,
    }))))
}

impl Args {
    /// The preset with what was given besides.
    fn params(&self) -> Result<Params, Error> {
        let mut overrides = Map::new();
        if let Some(text) = &self.rules {
            let rules: Value = serde_json::from_str(text)
                .map_err(|cause| Error::Usage(format!("--rules is not JSON: {cause}")))?;
            overrides.insert("rules".into(), rules);
        }
        let by = |by: &String| json!({ "by": by });
        let given = [
            ("matching", self.match_by.as_ref().map(by)),
            ("preset", self.preset.clone().map(Value::from)),
            ("count", self.count.map(Value::from)),
            ("frames", self.frames.map(Value::from)),
            ("seed", self.seed.map(Value::from)),
        ];
        for (name, value) in given {
            overrides.extend(value.map(|value| (name.to_owned(), value)));
        }
        params::read(overrides).map_err(|error| Error::Usage(error.to_string()))
    }
}
