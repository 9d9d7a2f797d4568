//! `flockreel sample`: writes footage of a virtual fish, and its true poses
//! (docs/explanation/algorithms.md, "Virtual fish").

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::json;

use super::{Error, Listener, Summary};
use crate::media::VideoWriter;
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::{FrameSource, SourceError};
use flockreel_core::formats::poses_json;
use flockreel_core::library::View;
use flockreel_core::progress::Progress;
use flockreel_core::raster::Frame;

/// Arguments of `sample`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Video to write (.mp4).
    #[arg(short, long, value_name = "MP4")]
    output: PathBuf,
    /// Also write the true poses, in the format of poses.json.
    #[arg(long, value_name = "JSON")]
    truth: Option<PathBuf>,
    /// Number of frames, 1 to 1000000.
    #[arg(long, default_value_t = 1200)]
    frames: usize,
    /// Random seed of the path, the scene and the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Frame rate, frames per second, 1 to 240.
    #[arg(long, default_value_t = 30.0)]
    fps: f64,
    /// Width and height of the picture, pixels, 64x64 to 7680x4320.
    #[arg(long, default_value = "640x480", value_name = "WxH", value_parser = parse_size)]
    size: [u32; 2],
    /// Side from which the tank is filmed.
    #[arg(long, default_value = "side", value_name = "VIEW", value_parser = view_parser())]
    view: View,
}

/// Writes the video and, if requested, the true poses.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let params = SampleParams {
        n_frames: args.frames,
        seed: args.seed,
        fps: args.fps,
        width: args.size[0],
        height: args.size[1],
        view: args.view,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params)?;
    let listener = Listener::new();
    write_video(&film, &args, &listener)?;
    if let Some(path) = &args.truth {
        listener.report("truth", 0.0);
        super::write_file(path, poses_json::write(&film.truth(), None))?;
    }
    Ok(Some(Summary(json!({
        "output": args.output.display().to_string(),
        "truth": args.truth.as_ref().map(|path| path.display().to_string()),
        "frames": args.frames,
        "seed": args.seed,
    }))))
}

fn write_video(film: &SampleFilm, args: &Args, listener: &Listener) -> Result<(), Error> {
    let mut writer = VideoWriter::create(&args.output, &film.format().into())?;
    let unreadable = |error: SourceError| Error::work(error.code, &error);
    let mut stream = film.open().map_err(unreadable)?;
    let (mut frame, mut n_written) = (Frame::default(), 0);
    while stream.next_frame(&mut frame).map_err(unreadable)?.is_some() {
        writer.write(&frame)?;
        n_written += 1;
        listener.report("filming", f64::from(n_written) / args.frames as f64);
    }
    Ok(writer.finish()?)
}

/// Parses a size such as `640x480`. Returns width and height.
pub(super) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').map(|(w, h)| (w.parse(), h.parse()));
    match sides {
        Some((Ok(width), Ok(height))) => Ok([width, height]),
        _ => Err("the size must have the form 640x480".into()),
    }
}

fn view_parser() -> impl TypedValueParser<Value = View> {
    let views = PossibleValuesParser::new(["side", "top"]);
    views.map(|name| if name == "top" { View::Top } else { View::Side })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_is_two_numbers_with_an_x_between() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        assert!(parse_size("640").is_err() && parse_size("ax1").is_err());
    }
}
