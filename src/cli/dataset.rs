//! `flockreel dataset`: makes a labelled data set of many flocks (docs/how-to/train-a-tracker.md).

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::sample::parse_size;
use super::{Error, Listener, Summary, set};
use crate::jobs::flock::dataset::folder::FolderError;
use crate::jobs::flock::dataset::manifest::{LibraryHash, Manifest, library_sha256, sha256_of};
use crate::jobs::flock::dataset::{Dataset, Estimate, MakeError};
use flockreel_core::dataset::Params;
use flockreel_core::formats::{params, picture};
use flockreel_core::library::Library;

/// Arguments of `dataset`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of libraries, written by `analyze`. Each flock is made from one of them.
    #[arg(value_name = "LIBRARY_DIR", required = true)]
    libraries: Vec<PathBuf>,
    /// Folder to write. If a run was stopped, the same command goes on; finished flocks are kept.
    #[arg(short, long, value_name = "DIR", required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    #[arg(long, help = set::parameter_help::<Params>("flocks"))]
    flocks: Option<u32>,
    #[arg(long, help = set::parameter_help::<Params>("pictures"))]
    pictures: Option<u32>,
    #[arg(long, help = set::parameter_help::<Params>("every"))]
    every: Option<u32>,
    #[command(flatten)]
    ranges: Ranges,
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help = set::parameter_help::<Params>("presets"))]
    presets: Option<Vec<String>>,
    #[arg(long, num_args = 3, value_names = ["TRAIN", "VAL", "TEST"], help = set::parameter_help::<Params>("split"))]
    split: Option<Vec<f64>>,
    #[arg(long, help = set::parameter_help::<Params>("picture"))]
    picture: Option<String>,
    #[arg(long, help = set::parameter_help::<Params>("seed"))]
    seed: Option<u64>,
    #[arg(long, value_name = "WxH", value_parser = parse_size, help = set::parameter_help::<Params>("size_px"))]
    size: Option<[u32; 2]>,
    /// Label files, separated by commas: coco, mot, one of yolo_detect, yolo_segment and yolo_pose, dlc, tracks,
    /// masks, depth [default: coco mot yolo_pose tracks].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    formats: Option<Vec<String>>,
    /// Folder of background pictures (.png, .jpg). By default, half of the flocks then have one of them; `--set
    /// backgrounds.picture=3` sets the weight of pictures, `backgrounds.plate` (1) that of the footage's background,
    /// and `backgrounds.color` (0.2) that of plain colors.
    #[arg(long, value_name = "DIR")]
    backgrounds: Option<PathBuf>,
    #[arg(long, value_name = "NAME=JSON", help = set::help("noise=[0,8]"))]
    set: Vec<String>,
    /// Licence of the footage, for the manifest and the README.
    #[arg(long, value_name = "TEXT", conflicts_with = "from")]
    licence: Option<String>,
    /// Source of the footage, for the manifest and the README.
    #[arg(long, value_name = "TEXT", conflicts_with = "from")]
    source: Option<String>,
    /// Make the data set of this manifest.json again, and compare the hashes of all files.
    #[arg(long, value_name = "FILE", conflicts_with_all = PARAMETERS)]
    from: Option<PathBuf>,
    /// Write a picture of nine samples with the truth drawn over them, before anything else.
    #[arg(long, value_name = "PNG")]
    sheet: Option<PathBuf>,
    /// Print the expected number of pictures, bytes and seconds, and make no data set.
    #[arg(long)]
    dry_run: bool,
}

/// Flags that set parameters, which a manifest has.
const PARAMETERS: [&str; 19] = [
    "flocks",
    "pictures",
    "every",
    "count",
    "presets",
    "split",
    "picture",
    "seed",
    "size",
    "formats",
    "set",
    "scale",
    "haze",
    "shadow",
    "gain",
    "color_gain",
    "blur",
    "noise",
    "jpeg_quality",
];

/// Flags that set ranges: two numbers, between which the value of each flock lies.
#[derive(Debug, clap::Args)]
struct Ranges {
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("count"))]
    count: Option<Vec<u32>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("scale"))]
    scale: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("haze_per_bl"))]
    haze: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("shadow"))]
    shadow: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("gain"))]
    gain: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("color_gain"))]
    color_gain: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("blur_px"))]
    blur: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("noise"))]
    noise: Option<Vec<f64>>,
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"], help = set::parameter_help::<Params>("jpeg_quality"))]
    jpeg_quality: Option<Vec<u32>>,
}

/// Makes the data set, or says how large it would be.
pub fn run(args: Args) -> Result<Option<Summary>, Error> {
    let given = args.from.as_deref().map(read_manifest).transpose()?;
    let params = match &given {
        Some(manifest) => manifest.params.clone(),
        None => args.params()?,
    };
    let target = args.output.as_deref().unwrap_or(Path::new("."));
    let (libraries, hashes) = read_libraries(&args.libraries, target)?;
    let backgrounds = args.backgrounds.as_deref().map(pictures_in).transpose()?;
    let backgrounds = backgrounds.unwrap_or_default();
    let background_hashes = hashes_of(&backgrounds)?;
    let terms = match &given {
        Some(manifest) => [manifest.licence.clone(), manifest.source.clone()],
        None => [args.licence.clone(), args.source.clone()],
    };
    let manifest = Manifest::new(params.clone(), terms, hashes, background_hashes);
    if let Some(given) = given.as_ref().filter(|given| given.request() != manifest) {
        return Err(Error::Usage(difference(given, &manifest)));
    }
    let dataset = Dataset::new(params, libraries, backgrounds)
        .map_err(|error| Error::Usage(error.to_string()))?;
    let progress = Listener::new();
    if let Some(path) = &args.sheet {
        let sheet = dataset.sheet(&progress).map_err(refused)?;
        super::write_file(path, picture::write_rgb(&sheet))?;
    }
    let Some(output) = args.output.as_deref().filter(|_| !args.dry_run) else {
        let estimate = dataset.estimate(&progress).map_err(refused)?;
        return Ok(Some(estimated(&estimate)));
    };
    let made = dataset.make(output, manifest, &progress).map_err(refused)?;
    let is_equal = given
        .map(|given| compare(&given, &made.manifest))
        .transpose()?;
    Ok(Some(Summary(json!({
        "output": output,
        "pictures": u64::from(dataset.params.flocks) * u64::from(dataset.params.pictures),
        "files": made.manifest.files.len() + 1,
        "bytes": made.manifest.files.iter().map(|file| file.bytes).sum::<u64>(),
        "kept_flocks": made.n_kept,
        "equals_manifest": is_equal.map(|()| true),
    }))))
}

impl Args {
    fn params(&self) -> Result<Params, Error> {
        let mut overrides = Map::new();
        let given = [
            ("flocks", self.flocks.map(Value::from)),
            ("pictures", self.pictures.map(Value::from)),
            ("every", self.every.map(Value::from)),
            ("presets", self.presets.clone().map(Value::from)),
            ("split", self.split.clone().map(Value::from)),
            ("picture", self.picture.clone().map(Value::from)),
            ("seed", self.seed.map(Value::from)),
            ("size_px", self.size.map(|size| json!(size))),
            ("formats", self.formats.clone().map(Value::from)),
        ];
        for (name, value) in given.into_iter().chain(self.ranges.given()) {
            overrides.extend(value.map(|value| (name.to_owned(), value)));
        }
        set::apply(&self.set, &mut overrides)?;
        params::read(overrides).map_err(|error| Error::Usage(error.to_string()))
    }
}

impl Ranges {
    /// Returns the values by the names of the parameters.
    fn given(&self) -> [(&'static str, Option<Value>); 9] {
        let whole = |range: &Option<Vec<u32>>| range.clone().map(Value::from);
        let real = |range: &Option<Vec<f64>>| range.clone().map(Value::from);
        [
            ("count", whole(&self.count)),
            ("scale", real(&self.scale)),
            ("haze_per_bl", real(&self.haze)),
            ("shadow", real(&self.shadow)),
            ("gain", real(&self.gain)),
            ("color_gain", real(&self.color_gain)),
            ("blur_px", real(&self.blur)),
            ("noise", real(&self.noise)),
            ("jpeg_quality", whole(&self.jpeg_quality)),
        ]
    }
}

fn read_libraries(
    folders: &[PathBuf],
    output: &Path,
) -> Result<(Vec<Library>, Vec<LibraryHash>), Error> {
    let (mut libraries, mut hashes) = (Vec::new(), Vec::new());
    for folder in folders {
        let stored = super::read_library(folder, output)?;
        let failed = Error::io(format!("reading the library: {}", folder.display()));
        hashes.push(LibraryHash {
            footage_sha256: stored.footage.sha256,
            sha256: library_sha256(folder).map_err(failed)?,
        });
        libraries.push(stored.library);
    }
    Ok((libraries, hashes))
}

/// Returns the pictures of a folder, by name.
fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let what = format!("reading the background pictures: {}", folder.display());
    let entries = fs::read_dir(folder).map_err(Error::io(what.clone()))?;
    let paths = entries.map(|entry| Ok(entry?.path()));
    let mut paths: Vec<PathBuf> = paths
        .collect::<std::io::Result<_>>()
        .map_err(Error::io(what))?;
    paths.retain(|path| ["png", "jpg", "jpeg"].contains(&super::extension(path).as_str()));
    paths.sort();
    if paths.is_empty() {
        return Err(Error::Usage(format!(
            "the folder has no .png or .jpg pictures: {}",
            folder.display()
        )));
    }
    Ok(paths)
}

fn hashes_of(paths: &[PathBuf]) -> Result<Vec<String>, Error> {
    let hash = |path: &PathBuf| sha256_of(std::iter::once(path.clone()));
    let hashes = paths.iter().map(hash).collect::<std::io::Result<_>>();
    hashes.map_err(Error::io("reading the background pictures"))
}

fn read_manifest(path: &Path) -> Result<Manifest, Error> {
    let what = format!("reading the manifest: {}", path.display());
    let bytes = fs::read(path).map_err(Error::io(what))?;
    serde_json::from_slice(&bytes)
        .map_err(|cause| Error::Usage(format!("not a manifest.json: {cause}: {}", path.display())))
}

/// Says which of the inputs differs from those of the manifest.
fn difference(given: &Manifest, own: &Manifest) -> String {
    if given.version != own.version {
        let (given, own) = (&given.version, &own.version);
        return format!("the manifest needs flockreel {given}; this is {own}");
    }
    let what = if given.libraries != own.libraries {
        "libraries are not those of the manifest; give the same folders in the same order"
    } else {
        "background pictures are not those of the manifest; give the same folder with --backgrounds"
    };
    format!("the {what}")
}

/// Compares the files of two manifests. Fails with the name of the first that differs.
fn compare(given: &Manifest, made: &Manifest) -> Result<(), Error> {
    let differing = (given.files.iter())
        .zip(&made.files)
        .find(|(given, made)| given != made);
    match differing {
        None if given.files.len() == made.files.len() => Ok(()),
        None => Err(Error::Usage(
            "the data set has another number of files than the manifest".into(),
        )),
        Some((_, file)) => Err(Error::Usage(format!(
            "the data set was made, but a file differs from the manifest: {}",
            file.path
        ))),
    }
}

fn refused(error: MakeError) -> Error {
    match error {
        MakeError::Folder(FolderError::Io(cause)) => Error::io("writing the data set")(cause),
        MakeError::Folder(error) => Error::Usage(error.to_string()),
        MakeError::Flock { number, cause } => Error::Work {
            code: cause.code(),
            sentence: format!("flock {number} of the data set: {cause}"),
        },
    }
}

/// Says how large the data set would be.
fn estimated(estimate: &Estimate) -> Summary {
    let Estimate {
        n_pictures,
        n_bytes,
        drawing_s,
    } = *estimate;
    let (megabytes, minutes) = (n_bytes as f64 / 1e6, drawing_s / 60.0);
    super::say(&format!(
        "pictures: {n_pictures}; about {megabytes:.0} MB and {minutes:.1} minutes of drawing"
    ));
    Summary(json!({"pictures": n_pictures, "bytes": n_bytes, "drawing_s": drawing_s}))
}
