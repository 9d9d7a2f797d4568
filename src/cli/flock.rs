//! `flockreel flock`: library to flock (DESIGN.md, Command line), as a video and, when asked for, its
//! plan as flock.json.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::{Error, Listener, Summary};
use crate::flock::{Compositor, Flock, Params, plan_flock};
use crate::formats::{flock_json, params, svg};
use crate::library::Library;
use crate::media::{self, VideoFormat, VideoWriter};
use crate::progress::Progress;
use crate::raster::ColorSpec;

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
    film(&library, &flock, &args.output, &progress)
        .map_err(|error| Error::work(error.code(), &error))?;
    Ok(Some(Summary(json!({
        "video": args.output,
        "plan": args.plan,
        "plan_picture": args.plan_picture,
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

fn film(
    library: &Library,
    flock: &Flock,
    path: &Path,
    progress: &dyn Progress,
) -> Result<(), media::Error> {
    let format = VideoFormat {
        width: flock.image_size_px[0],
        height: flock.image_size_px[1],
        fps: flock.fps,
        color: ColorSpec::default(),
    };
    let compositor = Compositor::with_color(library, flock, format.color);
    let n_frames = compositor.n_frames() as f64;
    let mut video = VideoWriter::create(path, &format)?;
    compositor.render_all(|frame_idx, frame| {
        progress.report("rendering", (frame_idx + 1) as f64 / n_frames);
        video.write(frame)
    })?;
    video.finish()
}
