//! `flockreel fish`: writes a virtual fish that swims like the animal, as a video or a 3-D model, or a school of them
//! (docs/explanation/algorithms.md, "Virtual fish").

use std::path::PathBuf;
use std::time::Instant;

use serde_json::{Map, Value, json};

use super::flock::read_plan;
use super::{Error, Listener, Summary, set};
use crate::media::{self, Tool, VideoFormat, VideoWriter};
use flockreel_core::fish::{self, Film, Params, side_by_side};
use flockreel_core::formats::{fish_json, glb, params};
use flockreel_core::geometry::rounded;
use flockreel_core::library::Library;
use flockreel_core::progress::Progress;
use flockreel_core::raster::{ColorSpec, Frame};

/// Arguments of `fish`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the library, written by `analyze`.
    #[arg(value_name = "LIBRARY_DIR")]
    library: PathBuf,
    /// File to write: a video (.mp4), an animated 3-D model (.glb), or its motion and tail beat as numbers (.json).
    #[arg(short, long, value_name = "MP4_GLB_OR_JSON")]
    output: PathBuf,
    /// Write every individual of this plan, a flock.json of the same library, each as a virtual fish. Needs .glb.
    #[arg(long, value_name = "FILE", conflicts_with = "side_by_side")]
    flock: Option<PathBuf>,
    /// Show the animal on the left and the virtual fish on the right. Needs .mp4.
    #[arg(long)]
    side_by_side: bool,
    #[arg(long, value_name = "NAME", help = set::presets_help::<Params>())]
    preset: Option<String>,
    #[arg(long, help = set::parameter_help::<Params>("body"))]
    body: Option<String>,
    #[arg(long, help = set::parameter_help::<Params>("palette"))]
    palette: Option<String>,
    #[arg(long, value_name = "NAME=JSON", help = set::help("bank_rad=0.4"))]
    set: Vec<String>,
}

/// Writes the virtual fish.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let params = params_of(&args)?;
    media::search_in_background(&[Tool::Ffmpeg]);
    let stored = super::read_library(&args.library, &args.output)?;
    let film = Film::of(&stored.library, &params)?;
    let motion = film.motion();
    let alike = fish::likeness(&stored.library, &film);
    let n_visible = motion.frames.iter().filter(|p| p.visible).count();
    let n_frames = motion.frames.len();
    let start = Instant::now();
    match super::extension(&args.output).as_str() {
        "glb" if args.side_by_side => {
            return Err(Error::Usage(
                "--side-by-side needs an output that ends in .mp4".into(),
            ));
        }
        "glb" => super::write_file(&args.output, model(&stored.library, &film, &args)?)?,
        "json" if !args.side_by_side && args.flock.is_none() => {
            super::write_file(&args.output, fish_json::write(motion))?;
        }
        "mp4" if args.flock.is_some() => {
            return Err(Error::Usage(
                "--flock needs an output that ends in .glb".into(),
            ));
        }
        "mp4" => write_video(&stored.library, &film, &args)?,
        other => {
            return Err(Error::Usage(format!(
                "the output must end in .mp4, .glb or .json: .{other}"
            )));
        }
    }
    Ok(Some(Summary(json!({
        "output": args.output.display().to_string(),
        "frames": n_frames,
        "visible_frames": n_visible,
        "written_s": rounded(start.elapsed().as_secs_f64(), 3),
        "compared_frames": alike.map_or(0, |alike| alike.n_frames),
        "silhouette_overlap": alike.map(|alike| rounded(alike.overlap, 3)),
        "color_difference_levels": alike.map(|alike| rounded(alike.color_levels, 1)),
    }))))
}

/// Returns the GLB file of the fish, or of a school of them.
fn model(library: &Library, film: &Film, args: &Args) -> Result<Vec<u8>, Error> {
    Ok(match &args.flock {
        Some(plan) => {
            let flock = read_plan(plan, library)?;
            glb::write_school(&flock, library.poses.view, film)
        }
        None => glb::write(film.motion(), film.renderer().mesh()),
    })
}

fn params_of(args: &Args) -> Result<Params, Error> {
    let given = [
        ("body", &args.body),
        ("palette", &args.palette),
        ("preset", &args.preset),
    ];
    let mut overrides: Map<String, Value> = given
        .into_iter()
        .filter_map(|(name, value)| Some((name.to_owned(), json!(value.as_ref()?))))
        .collect();
    set::apply(&args.set, &mut overrides)?;
    params::read(overrides).map_err(|error| Error::Usage(error.to_string()))
}

fn write_video(library: &Library, film: &Film, args: &Args) -> Result<(), Error> {
    let motion = film.motion();
    let [width, height] = motion.image_size_px;
    let n_frames = motion.frames.len();
    let video = VideoFormat {
        width: if args.side_by_side { 2 * width } else { width },
        height,
        fps: motion.fps,
        color: ColorSpec::default(),
    };
    let mut writer = VideoWriter::create(&args.output, &video)?;
    let listener = Listener::new();
    let mut frame = Frame::new(video.width, video.height, video.color);
    for frame_idx in 0..n_frames {
        if args.side_by_side {
            side_by_side::render(library, film, frame_idx, &mut frame)
        } else {
            film.render(frame_idx, &mut frame)
        }
        writer.write(&frame)?;
        listener.report("filming", (frame_idx + 1) as f64 / n_frames as f64);
    }
    Ok(writer.finish()?)
}
