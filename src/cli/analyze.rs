//! `flockreel analyze VIDEO -o LIBRARY_DIR`: measures the animal in a video and writes a library, without a
//! server (docs/reference/command-line.md).

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::{Error, Listener, Summary, set};
use crate::jobs::analysis::{Advice, read_options};
use crate::jobs::masks::Masks;
use crate::jobs::refusal::mend::Mend;
use crate::jobs::{refusal, views};
use crate::media::{self, Limits, Tool, Video, read_image};
use flockreel_core::analysis::{self, Params};
use flockreel_core::cpu;
use flockreel_core::footage::{FrameSource, Part};
use flockreel_core::formats::library_json::FootageSummary;
use flockreel_core::formats::{csv, library_dir, params, svg};
use flockreel_core::library::{Library, Poses, View};

/// Arguments of `analyze`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Footage of one animal, filmed with a fixed camera: a video, or pictures in a folder, a zip or a TIFF.
    video: PathBuf,
    /// Folder to write the library to.
    #[arg(short, long, value_name = "LIBRARY_DIR")]
    output: PathBuf,
    /// Picture of the scene without the animal. Default: estimated from the footage.
    #[arg(long, value_name = "IMAGE")]
    background: Option<PathBuf>,
    /// One mask per frame: a video, or pictures in a folder, a zip or a TIFF. White is the animal, black the
    /// rest, and gray the share of a pixel that the animal covers. Default: the alpha channel of the footage,
    /// if it has one.
    #[arg(long, value_name = "DIR|VIDEO")]
    masks: Option<PathBuf>,
    /// File with the calibrated camera, for results in metres: {"z_min_m": 0.7, "pane_px_per_m": 1000, ...}.
    #[arg(long, value_name = "JSON_FILE")]
    camera: Option<PathBuf>,
    /// Length of the animal from the nose to the tip of the tail, metres. Needs --animal-height.
    #[arg(long, value_name = "M", value_parser = set::finite, requires = "animal_height")]
    animal_length: Option<f64>,
    /// Height of the animal's silhouette, fins included, metres. Needs --animal-length.
    #[arg(long, value_name = "M", value_parser = set::finite, requires = "animal_length")]
    animal_height: Option<f64>,
    #[arg(long, help = set::parameter_help::<Params>("view"))]
    view: Option<String>,
    /// Follow the largest animal if several move. Default: the footage is refused.
    #[arg(long)]
    follow_largest: bool,
    #[arg(long, value_name = "F", value_parser = set::finite, help = set::parameter_help::<Params>("fps"))]
    fps: Option<f64>,
    #[arg(long, value_name = "SECONDS", value_parser = set::finite, help = set::parameter_help::<Params>("from_s"))]
    from: Option<f64>,
    #[arg(long, value_name = "SECONDS", value_parser = set::finite, help = set::parameter_help::<Params>("to_s"))]
    to: Option<f64>,
    /// Position of the animal in one frame: frame number and pixels, such as 120:310,95. The analysis follows
    /// the object at this point.
    #[arg(long, value_name = "FRAME:X,Y")]
    animal_at: Option<String>,
    /// Box in which nothing counts as the animal, pixels, for the whole film or a range of seconds, such as
    /// 10,20,200,40@0-2.5. Repeatable.
    #[arg(long, value_name = "X,Y,W,H[@FROM-TO]")]
    ignore: Vec<String>,
    #[arg(long, value_name = "R", value_parser = set::finite, help = set::parameter_help::<Params>("pixel_aspect"))]
    pixel_aspect: Option<f64>,
    #[arg(long, value_name = "F", help = set::parameter_help::<Params>("clip_frames"))]
    clip_frames: Option<u32>,
    #[arg(long, value_name = "NAME", help = set::parameter_help::<Params>("clip_weights"))]
    clip_weights: Option<String>,
    #[arg(long, value_name = "NAME", help = set::parameter_help::<Params>("scale_mode"))]
    scale_mode: Option<String>,
    #[arg(long, value_name = "E", help = set::parameter_help::<Params>("epsilon"))]
    epsilon: Option<u64>,
    /// Also write the video with the measured poses drawn over it.
    #[arg(long, value_name = "MP4")]
    overlay: Option<PathBuf>,
    #[arg(long, value_name = "NAME", help = set::presets_help::<Params>())]
    preset: Option<String>,
    #[arg(long, value_name = "NAME=JSON", help = set::help("threshold=25"))]
    set: Vec<String>,
}

/// Analyzes the video and writes the library. Prints advice about the footage to stderr.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let params = params_of(&args)?;
    let optional = [&args.background, &args.masks];
    let inputs = optional.into_iter().flatten();
    for path in [&args.video].into_iter().chain(inputs) {
        File::open(path).map_err(|cause| {
            Error::Usage(format!("cannot read the file: {cause}: {}", path.display()))
        })?;
    }
    media::search_in_background(&[Tool::Ffprobe, Tool::Ffmpeg]);
    let limits = Limits::default();
    let options = read_options(&params);
    let video = Video::open_with(&args.video, &limits, &options)?;
    let background = args.background.as_deref();
    let background = background
        .map(|path| read_image(path, &limits))
        .transpose()?;
    let progress = Listener::new();
    let level = cpu::Level::detect();
    let scratch = super::scratch_beside(&args.output);
    let background = background.as_ref();
    let given = args.masks.as_deref();
    let masks = Masks::open(&video, &args.video, given, &limits, &options)?;
    let masked = masks.as_ref().map(|masks| masks.over(&video));
    let masked = masked.transpose()?;
    let source: &dyn FrameSource = match &masked {
        Some(masked) => masked,
        None => &video,
    };
    let library = analysis::analyze(source, background, &params, level, &scratch, &progress)
        .map_err(|error| {
            show_refusal(source, &error, &params, &args.output);
            Error::work(error.code(), &error)
        })?;
    let footage = footage_summary(video.files())?;
    library_dir::write(&args.output, &library, &params, &footage)
        .map_err(|error| Error::Usage(format!("cannot write the library: {error}")))?;
    write_views(&args.output, &library)?;
    if let Some(path) = &args.overlay {
        let part = Part::new(source, params.from_s, params.to_s);
        views::write_overlay(&part, &library.poses, path, &progress)?;
    }
    super::say(&view_sentence(&library.poses));
    let advice = Advice::for_library(&library, &params, video.notices());
    for Advice { code, sentence } in &advice {
        super::say(&format!("{sentence} ({code})"));
    }
    Ok(Some(summary(&library, &args.output, &advice)))
}

/// Prints the flags that may mend a refusal. Writes a picture of the frames that show its reason, beside the output
/// folder, and prints its path.
fn show_refusal(film: &dyn FrameSource, error: &analysis::Error, params: &Params, output: &Path) {
    let mends = Mend::all_of(error, params, &film.format());
    if !mends.is_empty() {
        let flags: Vec<String> = mends.iter().map(flag_of).collect();
        super::say(&format!("one of these may help: {}", flags.join(", ")));
    }
    let Some(picture) = refusal::picture(film, error) else {
        return;
    };
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    let path = output.with_file_name(format!("{name}.{}", refusal::FILE_NAME));
    let folder = output.parent().unwrap_or(Path::new(""));
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, picture));
    match written {
        Ok(()) => super::say(&format!(
            "picture of the refused frames: {}",
            path.display()
        )),
        Err(cause) => super::say(&format!("cannot write {}: {cause}", path.display())),
    }
}

/// Returns the flag that does what a mend proposes, with the placeholder of its help if nothing is proposed.
fn flag_of(Mend { param, value }: &Mend) -> String {
    let or = |name: &str| match value {
        Value::Null => name.to_owned(),
        value => value.to_string(),
    };
    let numbers = |value: &Value| {
        let all = value.as_array().into_iter().flatten();
        all.map(Value::to_string).collect::<Vec<_>>().join(",")
    };
    match param.as_str() {
        "animal_at" if value.is_null() => "--animal-at FRAME:X,Y".to_owned(),
        "animal_at" => format!(
            "--animal-at {}:{}",
            value["frame"],
            numbers(&value["at_px"])
        ),
        "follow" => "--follow-largest".to_owned(),
        "ignore" => match value.as_array().and_then(|boxes| boxes.last()) {
            Some(new) => format!("--ignore {}", numbers(&new["box_px"])),
            None => "--ignore X,Y,W,H".to_owned(),
        },
        "from_s" => format!("--from {}", or("SECONDS")),
        "to_s" => format!("--to {}", or("SECONDS")),
        "background" => "--background IMAGE".to_owned(),
        "masks" => "--masks DIR|VIDEO".to_owned(),
        "fps" => format!("--fps {}", or("F")),
        name => format!("--set {name}={}", or("JSON")),
    }
}

/// Writes the files for people: the table of poses and the charts.
fn write_views(folder: &Path, library: &Library) -> Result<(), Error> {
    let table = ("poses.csv", csv::write_poses(&library.poses));
    for (name, text) in svg::pictures(library).into_iter().chain([table]) {
        super::write_file(&folder.join(name), text)?;
    }
    Ok(())
}

/// Returns the preset with the parameters set by flags.
fn params_of(args: &Args) -> Result<Params, Error> {
    let animal_at = args.animal_at.as_deref().map(read_animal_at);
    let ignored = args.ignore.iter().map(|text| read_ignore(text));
    let ignored = ignored.collect::<Result<Vec<Value>, Error>>()?;
    let animal = args.animal_length.zip(args.animal_height);
    let animal = animal.map(|(length, height)| json!({"length_m": length, "height_m": height}));
    let given = [
        ("preset", args.preset.clone().map(Value::from)),
        ("view", args.view.clone().map(Value::from)),
        ("follow", args.follow_largest.then(|| json!("largest"))),
        ("fps", args.fps.map(Value::from)),
        ("pixel_aspect", args.pixel_aspect.map(Value::from)),
        ("from_s", args.from.map(Value::from)),
        ("to_s", args.to.map(Value::from)),
        ("animal_at", animal_at.transpose()?),
        ("ignore", (!ignored.is_empty()).then(|| json!(ignored))),
        ("clip_frames", args.clip_frames.map(Value::from)),
        ("clip_weights", args.clip_weights.clone().map(Value::from)),
        ("scale_mode", args.scale_mode.clone().map(Value::from)),
        ("epsilon", args.epsilon.map(Value::from)),
        ("animal", animal),
        ("camera", args.camera.as_deref().map(read_json).transpose()?),
    ];
    let mut overrides: Map<String, Value> = given
        .into_iter()
        .filter_map(|(name, value)| Some((name.to_owned(), value?)))
        .collect();
    set::apply(&args.set, &mut overrides)?;
    params::read(overrides).map_err(|error| Error::Usage(error.to_string()))
}

/// Parses FRAME:X,Y to the parameter `animal_at`.
pub fn read_animal_at(text: &str) -> Result<Value, Error> {
    let parts = text.split_once(':').and_then(|(frame, point)| {
        let (x, y) = point.split_once(',')?;
        let frame: u32 = frame.trim().parse().ok()?;
        Some((frame, [number(x)?, number(y)?]))
    });
    let (frame, point) = parts.ok_or_else(|| {
        Error::Usage(format!(
            "--animal-at takes FRAME:X,Y, such as 120:310,95: {text}"
        ))
    })?;
    Ok(json!({"frame": frame, "at_px": point}))
}

/// Parses X,Y,W,H or X,Y,W,H@FROM-TO to an entry of the parameter `ignore`.
pub fn read_ignore(text: &str) -> Result<Value, Error> {
    let wanted = || {
        let example = "10,20,200,40 or 10,20,200,40@0-2.5";
        Error::Usage(format!(
            "--ignore takes X,Y,W,H or X,Y,W,H@FROM-TO, such as {example}: {text}"
        ))
    };
    let (sides, span) = match text.split_once('@') {
        Some((sides, span)) => (sides, Some(span)),
        None => (text, None),
    };
    let sides: Option<Vec<u32>> = sides
        .split(',')
        .map(|side| side.trim().parse().ok())
        .collect();
    let box_px: Option<[u32; 4]> = sides.and_then(|sides| sides.try_into().ok());
    let box_px = box_px.ok_or_else(wanted)?;
    let Some(span) = span else {
        return Ok(json!({"box_px": box_px}));
    };
    let (from_s, to_s) = span.split_once('-').ok_or_else(wanted)?;
    let from_s = number(from_s).ok_or_else(wanted)?;
    let to_s = number(to_s).ok_or_else(wanted)?;
    Ok(json!({"box_px": box_px, "from_s": from_s, "to_s": to_s}))
}

fn number(text: &str) -> Option<f64> {
    set::finite(text.trim()).ok()
}

fn read_json(path: &Path) -> Result<Value, Error> {
    let text = std::fs::read(path)
        .map_err(|cause| Error::Usage(format!("cannot read {}: {cause}", path.display())))?;
    serde_json::from_slice(&text)
        .map_err(|cause| Error::Usage(format!("{} is not JSON: {cause}", path.display())))
}

/// Returns the total size and the SHA-256 of all files, in order.
fn footage_summary(files: &[PathBuf]) -> Result<FootageSummary, Error> {
    let (mut hash, mut n_bytes) = (Sha256::new(), 0);
    let mut chunk = vec![0; 1 << 20];
    for path in files {
        let failed = || Error::io(format!("cannot read {}", path.display()));
        let mut file = File::open(path).map_err(failed())?;
        loop {
            let n = file.read(&mut chunk).map_err(failed())?;
            if n == 0 {
                break;
            }
            hash.update(&chunk[..n]);
            n_bytes += n as u64;
        }
    }
    let hash = hash.finalize();
    let sha256 = hash.iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(FootageSummary { sha256, n_bytes })
}

/// Returns a sentence with the view, its probability, and the flag that changes it.
fn view_sentence(poses: &Poses) -> String {
    let (seen, other) = match poses.view {
        View::Side => ("from the side", "top"),
        View::Top => ("from above", "side"),
    };
    match poses.view_confidence {
        None => format!("the view is {seen}, as set by --view"),
        Some(probability) => format!(
            "the view seems to be {seen} (probability {:.0} %); use --view {other} if this is wrong",
            100.0 * probability
        ),
    }
}

fn summary(library: &Library, output: &Path, advice: &[Advice]) -> Summary {
    let stats = &library.stats;
    Summary(json!({
        "library": output.display().to_string(),
        "n_frames": stats.n_frames,
        "n_detected": stats.n_detected,
        "n_transitions": stats.n_transitions,
        "component_share": stats.component_share,
        "sprite_size_px": [library.sprites.width(), library.sprites.height()],
        "advice": advice,
    }))
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use flockreel_core::code::Code;

    use super::*;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    fn parsed(flags: &str) -> Result<Args, clap::Error> {
        let words = ["analyze", "film.mp4", "-o", "library"].into_iter();
        Command::try_parse_from(words.chain(flags.split(' '))).map(|command| command.args)
    }

    #[test]
    fn the_flag_of_a_mend_sets_its_value() {
        let boxes = json!([{"box_px": [1, 2, 3, 4], "from_s": null, "to_s": null}]);
        for (param, value) in [
            ("animal_at", json!({"frame": 60, "at_px": [320.0, 240.0]})),
            ("follow", json!("largest")),
            ("ignore", boxes),
            ("from_s", json!(2.5)),
            ("to_s", json!(4.2)),
            ("threshold", json!(9)),
        ] {
            let mend = Mend {
                param: param.to_owned(),
                value: value.clone(),
            };
            let args = parsed(&flag_of(&mend)).expect("the flag exists");
            let params = params_of(&args).expect("good values");
            assert_eq!(serde_json::to_value(params).unwrap()[param], value);
        }
    }

    #[test]
    fn the_flag_of_every_mend_exists() {
        for mend in Code::ALL.iter().flat_map(|&code| Mend::all_for(code)) {
            let flag = flag_of(&mend).replace("SECONDS", "2").replace(" F", " 30");
            assert!(parsed(&flag).is_ok(), "{flag}");
        }
    }
}
