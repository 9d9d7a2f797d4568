//! README.md of a data set: a card for people that says what it shows, what the labels mean, and how to make it
//! again.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Dataset;
use super::manifest::Manifest;
use flockreel_core::dataset::{Format, Split};
use flockreel_core::flock::composite::keypoints::NAMES;

/// Returns the text.
pub(super) fn write(dataset: &Dataset, manifest: &Manifest) -> String {
    let params = &dataset.params;
    let stated = |text: &Option<String>| text.clone().unwrap_or_else(|| "not stated".into());
    let mut text = format!(
        "# Data set made by flockreel {version}\n\n\
         Pictures of many animals with known labels. Each animal is a sequence of frames of a film of one animal, \
         placed, turned and mirrored by a simulation; nobody labelled anything by hand.\n\n\
         | | |\n| --- | --- |\n\
         | source of the footage | {source} |\n\
         | licence of the footage | {licence} |\n\
         | libraries (films of one animal) | {libraries} |\n\
         | background pictures | {backgrounds} |\n\
         | flocks (sequences) | {flocks} |\n\
         | pictures | {pictures} |\n\
         | individuals in a picture | {low} to {high} |\n\
         | seed | {seed} |\n",
        version = manifest.version,
        source = stated(&manifest.source),
        licence = stated(&manifest.licence),
        libraries = manifest.libraries.len(),
        backgrounds = manifest.backgrounds.len(),
        flocks = params.flocks,
        pictures = u64::from(params.flocks) * u64::from(params.pictures),
        low = params.count[0],
        high = params.count[1],
        seed = params.seed,
    );
    let mut by_split: BTreeMap<Split, u32> = BTreeMap::new();
    for split in dataset.plan.split_of_each() {
        *by_split.entry(*split).or_default() += 1;
    }
    text += "\n| subset | flocks | pictures |\n| --- | --- | --- |\n";
    for (split, n) in by_split {
        let n_pictures = u64::from(n) * u64::from(params.pictures);
        // Cannot fail: a string has room.
        writeln!(text, "| {} | {n} | {n_pictures} |", split.name()).ok();
    }
    text += "\n## Files\n\n| file | content |\n| --- | --- |\n";
    for (path, content) in files(params.picture.extension(), &params.formats) {
        writeln!(text, "| `{path}` | {content} |").ok();
    }
    text += &conventions();
    text += LIMITS;
    text
}

fn files(extension: &str, formats: &[Format]) -> Vec<(String, &'static str)> {
    let mut files = vec![(
        format!("images/SUBSET/FLOCK/000001.{extension}"),
        "pictures, numbered from 1 in each flock",
    )];
    for format in formats {
        files.extend(match format {
            Format::Coco => vec![(
                "annotations/SUBSET.json".to_owned(),
                "COCO: masks, boxes and keypoints; `track_id` is unique in a flock",
            )],
            Format::Mot => vec![(
                "sequences/SUBSET/FLOCK/gt/gt.txt, seqinfo.ini".to_owned(),
                "MOTChallenge tracks",
            )],
            Format::YoloDetect => vec![(yolo(), "YOLO boxes")],
            Format::YoloSegment => vec![(yolo(), "YOLO outlines")],
            Format::YoloPose => vec![(yolo(), "YOLO boxes and keypoints")],
            Format::Dlc => vec![(
                "sequences/SUBSET/FLOCK/CollectedData_flockreel.csv".to_owned(),
                "DeepLabCut labels",
            )],
            Format::Tracks => vec![(
                "sequences/SUBSET/FLOCK/tracks.csv, tracks_dlc.csv".to_owned(),
                "all individuals of every picture, hidden or not; `frame` counts frames of the flock",
            )],
            Format::Masks => vec![(
                "sequences/SUBSET/FLOCK/masks/000001.png".to_owned(),
                "16-bit gray: label of the individual visible in each pixel",
            )],
            Format::Depth => vec![(
                "sequences/SUBSET/FLOCK/depth/000001.png".to_owned(),
                "16-bit gray: 1 for the nearest individual of the flock, 2 for the next, and so on; 0 = background",
            )],
        });
    }
    files.push((
        "sequences/SUBSET/FLOCK/report.json".to_owned(),
        "crossings, hidden spans and nearest distances; spans count pictures from 0",
    ));
    files.push((
        "manifest.json".to_owned(),
        "parameters, seeds, what each flock shows, and the SHA-256 of every file",
    ));
    files
}

fn yolo() -> String {
    "data.yaml, labels/SUBSET/FLOCK/000001.txt".to_owned()
}

fn conventions() -> String {
    format!(
        "\n## Labels\n\n\
         - Coordinates are pixels: x right, y down, the center of the first pixel at (0.5, 0.5).\n\
         - Masks and boxes describe the visible part. COCO and MOTChallenge also have boxes of the whole animal.\n\
         - Keypoints: {}. Visibility: 2 visible, 1 hidden by another animal or outside of the picture, 0 not measured.\n\
         - `keypoint_source` in COCO and `tracks.csv`: `midline` (measured in the filmed frame), `body_ends` (head and \
         tail are the ends of the filmed silhouette) or `none`.\n\n\
         ## Make it again\n\n\
         `flockreel dataset --from manifest.json LIBRARY... -o FOLDER` makes the same bytes with the same version and \
         libraries, on any number of threads, and compares the hashes.\n",
        NAMES.join(", ")
    )
}

const LIMITS: &str = "
## Limits

- All animals of a flock look like the one that was filmed. A model trained on one animal is not tested on another one.
- The animals do not touch, push or watch each other. Bodies overlap as layers.
- Flocks of the test subset come from the same films as those for training, unless each subset was made from other films.
";
