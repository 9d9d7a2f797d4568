//! Flags of `flockreel flock` about its film, and the files that they request
//! (docs/explanation/algorithms.md, "Compositing").

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::cli::sample::parse_size;
use crate::cli::{Error, extension, set};
use crate::jobs::flock::film::Backdrop;
use crate::jobs::flock::target::{Output, Target};
use crate::media::{Limits, Video, read_image};
use flockreel_core::flock::Params;
use flockreel_core::flock::composite::params::{Background, Format, Render};
use flockreel_core::raster::RgbImage;

/// Flags about the film.
#[derive(Debug, clap::Args)]
pub(super) struct Outputs {
    /// File to write. Films: .mp4, .webm, .mov (ProRes). Previews, at most 480 pixels wide, 15 frames per
    /// second and 10 seconds long: .gif, .webp. Middle frame: .png, .jpg. All frames as pictures: .zip, or a
    /// folder with --format png.
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: PathBuf,
    /// Format of the output. Default: by the extension of its name.
    #[arg(long, value_name = "mp4|webm|mov|png|gif|webp|poster")]
    format: Option<String>,
    /// Width and height of the film, pixels. The film always shows the whole picture of the footage. Default:
    /// the size of the footage.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Background: plate (default, the background of the footage), transparent, a color as #rrggbb, or the
    /// file of a picture or video.
    #[arg(long, value_name = "WHAT")]
    background: Option<String>,
    #[arg(long, help = set::parameter_help::<Params>("render.cut"))]
    cut: Option<String>,
    #[arg(long, value_name = "SHARE", value_parser = set::finite, help = set::parameter_help::<Params>("render.haze_per_bl"))]
    haze: Option<f64>,
    #[arg(long, value_name = "SHARE", value_parser = set::finite, help = set::parameter_help::<Params>("render.shadow"))]
    shadow: Option<f64>,
    /// Also write a video that marks the position and heading of every boid.
    #[arg(long, value_name = "MP4")]
    overlay: Option<PathBuf>,
    /// Also write the middle frame, as .png or .jpg.
    #[arg(long, value_name = "PICTURE")]
    poster: Option<PathBuf>,
    /// Also write the ground truth of every frame to this folder: masks, coco.json, MOTChallenge files,
    /// tracks.csv.
    #[arg(long, value_name = "DIR")]
    pub(super) ground_truth: Option<PathBuf>,
}

/// Background of the film, with its file opened.
pub(super) enum OpenBackground {
    /// As the `render` parameters say.
    FromParams,
    /// A picture.
    Picture(RgbImage),
    /// A video.
    Video(Box<Video>),
}

impl Outputs {
    /// Returns the `render` parameters that the flags set.
    pub(super) fn overrides(&self) -> Map<String, Value> {
        let named = self.named_background().map(Value::from);
        let given = [
            ("size_px", self.size.map(|size| json!(size))),
            ("background", named),
            ("cut", self.cut.clone().map(Value::from)),
            ("haze_per_bl", self.haze.map(Value::from)),
            ("shadow", self.shadow.map(Value::from)),
        ];
        let given = given.into_iter();
        given
            .filter_map(|(name, value)| Some((name.to_owned(), value?)))
            .collect()
    }

    /// Returns the files to write. Fails if one cannot store a transparent background that is requested.
    pub(super) fn targets(&self, render: &Render) -> Result<Vec<Target>, Error> {
        let format = match &self.format {
            Some(name) => serde_json::from_value(Value::from(name.as_str()))
                .map_err(|_unknown| Error::Usage(format!("the format is unknown: {name}")))?,
            None => format_of(&self.output)?,
        };
        let mut targets = vec![Target {
            output: Output::Film(format),
            path: self.output.clone(),
        }];
        targets.extend(self.poster.clone().map(|path| Target {
            output: Output::Film(Format::Poster),
            path,
        }));
        targets.extend(self.overlay.clone().map(|path| Target {
            output: Output::Overlay,
            path,
        }));
        let is_transparent = render.background == Background::Transparent;
        match targets
            .iter()
            .find(|target| is_transparent && !keeps_alpha(target))
        {
            Some(target) => Err(Error::Usage(format!(
                "this format has no transparency, use .webm, .mov, .webp or --format png: {}",
                target.path.display()
            ))),
            None => Ok(targets),
        }
    }

    /// Opens the picture or video that is named as background, if any.
    pub(super) fn open_background(&self) -> Result<OpenBackground, Error> {
        let named = self.named_background();
        let Some(path) = self.background.as_deref().filter(|_| named.is_none()) else {
            return Ok(OpenBackground::FromParams);
        };
        let path = Path::new(path);
        if !path.is_file() {
            return Err(Error::Usage(format!(
                "--background must be plate, transparent, #rrggbb or a file: {}",
                path.display()
            )));
        }
        let limits = Limits::default();
        Ok(match extension(path).as_str() {
            "png" | "jpg" | "jpeg" => OpenBackground::Picture(read_image(path, &limits)?),
            _ => OpenBackground::Video(Box::new(Video::open(path, &limits)?)),
        })
    }

    /// Returns the background, unless it is a file.
    fn named_background(&self) -> Option<String> {
        let text = self.background.as_ref()?;
        Background::try_from(text.clone()).ok().map(String::from)
    }
}

impl OpenBackground {
    /// Returns the background in the type that `Film` takes.
    pub(super) fn backdrop(&self) -> Backdrop<'_> {
        match self {
            OpenBackground::FromParams => Backdrop::FromParams,
            OpenBackground::Picture(picture) => Backdrop::Picture(picture),
            OpenBackground::Video(video) => Backdrop::Film(video.as_ref()),
        }
    }
}

fn keeps_alpha(target: &Target) -> bool {
    match target.output {
        Output::Overlay => true, // it has its own background
        Output::Film(Format::Poster) => {
            !["jpg", "jpeg"].contains(&extension(&target.path).as_str())
        }
        Output::Film(format) => format.has_alpha(),
    }
}

/// Returns the format for the extension of a file name. Fails if it is unknown.
fn format_of(path: &Path) -> Result<Format, Error> {
    match extension(path).as_str() {
        "mp4" | "m4v" => Ok(Format::Mp4),
        "webm" => Ok(Format::Webm),
        "mov" => Ok(Format::Mov),
        "gif" => Ok(Format::Gif),
        "webp" => Ok(Format::Webp),
        "png" | "jpg" | "jpeg" => Ok(Format::Poster),
        "zip" => Ok(Format::Png),
        _ => Err(Error::Usage(format!(
            "the file name has no known extension, add --format mp4, webm, mov, png, gif or webp: {}",
            path.display()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        outputs: Outputs,
    }

    fn outputs(words: &str) -> Outputs {
        Arguments::parse_from(["flock"].into_iter().chain(words.split_whitespace())).outputs
    }

    fn render(outputs: &Outputs) -> Render {
        let given = Value::Object(outputs.overrides());
        serde_json::from_value(given).expect("good flags")
    }

    #[test]
    fn extension_gives_the_format_and_a_flag_overrides_it() {
        for (words, format) in [
            ("-o a.mp4", Format::Mp4),
            ("-o a.WEBM", Format::Webm),
            ("-o a.mov", Format::Mov),
            ("-o a.jpg", Format::Poster),
            ("-o frames --format png", Format::Png),
            ("-o a.zip", Format::Png),
        ] {
            let targets = outputs(words)
                .targets(&Render::default())
                .expect("good flags");
            assert_eq!(targets[0].output, Output::Film(format), "{words}");
        }
        let said = outputs("-o frames").targets(&Render::default());
        assert!(
            said.expect_err("no format")
                .to_string()
                .ends_with(": frames")
        );
    }

    #[test]
    fn formats_without_alpha_are_refused_for_a_transparent_background() {
        for (words, is_good) in [
            ("-o a.mp4 --background transparent", false),
            ("-o a.gif --background transparent", false),
            ("-o a.webm --background transparent", true),
            ("-o a.webm --background transparent --poster p.jpg", false),
            ("-o a.webm --background transparent --poster p.png", true),
            ("-o a.mp4 --background #102030", true),
        ] {
            let outputs = outputs(words);
            let targets = outputs.targets(&render(&outputs));
            assert_eq!(targets.is_ok(), is_good, "{words}");
        }
    }
}
