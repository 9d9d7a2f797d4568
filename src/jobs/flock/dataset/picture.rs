//! One picture of a data set with its labels, in memory. Pictures are independent of each other, so all threads
//! draw them.

use super::files::WORK;
use super::scene::Film;
use flockreel_core::dataset::{Format, Picture};
use flockreel_core::flock::Shot;
use flockreel_core::flock::composite::truth::Seen;
use flockreel_core::formats::ground_truth::dlc::{self, Layout};
use flockreel_core::formats::ground_truth::{coco, mot, tracks, yolo};
use flockreel_core::formats::picture;
use flockreel_core::raster::RgbImage;

/// Content of one picture and of its labels.
pub(super) struct Labelled {
    /// Files of this picture only: path in the data set, and bytes.
    pub(super) files: Vec<(String, Vec<u8>)>,
    /// Lines for the files of the sequence, in the order of [`Film::texts`].
    pub(super) lines: Vec<Vec<u8>>,
    /// Truth of each individual, for the report.
    pub(super) seen: Vec<Seen>,
}

impl Labelled {
    /// Returns the number of bytes of all files and lines.
    pub(super) fn n_bytes(&self) -> usize {
        let files = self.files.iter().map(|(_, bytes)| bytes.len());
        files.chain(self.lines.iter().map(Vec::len)).sum()
    }
}

/// A file of a sequence to which every picture adds lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Text {
    /// Entries of the COCO list `images`, one a line.
    CocoImages,
    /// Entries of the COCO list `annotations`, one a line.
    CocoAnnotations,
    /// gt/gt.txt
    Mot,
    /// tracks.csv
    Tracks,
    /// tracks_dlc.csv
    TracksDlc,
    /// CollectedData_flockreel.csv
    Dlc,
}

impl Text {
    /// Returns the texts of a format.
    pub(super) fn of(format: Format) -> &'static [Text] {
        match format {
            Format::Coco => &[Text::CocoImages, Text::CocoAnnotations],
            Format::Mot => &[Text::Mot],
            Format::Tracks => &[Text::Tracks, Text::TracksDlc],
            Format::Dlc => &[Text::Dlc],
            Format::Masks
            | Format::Depth
            | Format::YoloDetect
            | Format::YoloSegment
            | Format::YoloPose => &[],
        }
    }
}

impl Film<'_> {
    /// Draws a picture, numbered from 0, with its labels. `shot` is memory for reuse.
    pub(super) fn picture(&self, number: u32, shot: &mut Shot) -> Labelled {
        let rgb = self.render(number, shot);
        let bytes = match self.params().picture {
            Picture::Jpeg => picture::write_jpeg_of(&rgb, self.look().jpeg_quality),
            Picture::Png => picture::write_rgb(&rgb),
        };
        let mut files = vec![(self.picture_path(number), bytes)];
        if self.params().formats.contains(&Format::Masks) {
            let [width, height] = shot.truth.size_px;
            let mask = picture::write_labels(width, height, &shot.truth.labels);
            let path = format!("{}/masks/{:06}.png", self.folder(), number + 1);
            files.push((path, mask));
        }
        if self.params().formats.contains(&Format::Depth) {
            let [width, height] = shot.truth.size_px;
            let depth = picture::write_labels(width, height, &shot.truth.depth_order());
            let path = format!("{}/depth/{:06}.png", self.folder(), number + 1);
            files.push((path, depth));
        }
        if let Some(task) = self.params().yolo() {
            let folder = self.picture_folder().replacen("images", "labels", 1);
            let path = format!("{folder}/{:06}.txt", number + 1);
            files.push((path, yolo::labels(task, &shot.truth).into_bytes()));
        }
        let texts = self.texts().into_iter();
        Labelled {
            files,
            lines: texts.map(|text| self.lines(text, number, shot)).collect(),
            seen: std::mem::take(&mut shot.truth.seen),
        }
    }

    /// Returns the files to which every picture adds lines.
    pub(super) fn texts(&self) -> Vec<Text> {
        let formats = self.params().formats.iter();
        formats
            .flat_map(|&format| Text::of(format))
            .copied()
            .collect()
    }

    /// Returns the path of such a file in the data set.
    pub(super) fn text_path(&self, text: Text) -> String {
        let (folder, name) = (self.folder(), self.name());
        match text {
            Text::CocoImages => format!("{WORK}/{name}.images"),
            Text::CocoAnnotations => format!("{WORK}/{name}.annotations"),
            Text::Mot => format!("{folder}/gt/gt.txt"),
            Text::Tracks => format!("{folder}/tracks.csv"),
            Text::TracksDlc => format!("{folder}/tracks_dlc.csv"),
            Text::Dlc => format!("{folder}/CollectedData_flockreel.csv"),
        }
    }

    /// Returns the first lines of such a file.
    pub(super) fn header(&self, text: Text) -> Vec<u8> {
        let count = self.flock().individuals.len();
        let mut header = Vec::new();
        let written = match text {
            Text::CocoImages | Text::CocoAnnotations | Text::Mot => Ok(()),
            Text::Tracks => {
                header = tracks::header().into_bytes();
                Ok(())
            }
            Text::TracksDlc => dlc::write_header(&mut header, Layout::Predictions, count),
            Text::Dlc => dlc::write_header(&mut header, Layout::Labels, count),
        };
        written.expect("writing to memory cannot fail");
        header
    }

    /// Returns the lines of a picture in a file of the sequence.
    fn lines(&self, text: Text, number: u32, shot: &Shot) -> Vec<u8> {
        let (frame, index, truth) = (self.frame(number), number as usize, &shot.truth);
        let (flock, shape, mut out) = (self.flock(), self.shape(), Vec::new());
        let written = match text {
            Text::CocoImages => {
                let name = self.picture_path(number);
                let image = coco::Image::new(self.image_id(number), name, &shape, frame);
                push(&mut out, &image);
                Ok(())
            }
            Text::CocoAnnotations => {
                let image_id = self.image_id(number);
                let most = u64::from(self.params().count[1]);
                for mut annotation in coco::annotations(flock, frame, truth, image_id) {
                    annotation.id = (image_id - 1) * most + u64::from(annotation.track_id);
                    push(&mut out, &annotation);
                }
                Ok(())
            }
            Text::Mot => mot::write_frame(&mut out, flock, index, truth),
            Text::Tracks => tracks::write_frame(&mut out, flock, &shape, frame, truth),
            Text::TracksDlc => {
                let name = number.to_string();
                dlc::write_frame(&mut out, Layout::Predictions, &name, truth)
            }
            Text::Dlc => {
                let extension = self.params().picture.extension();
                let name = self.name();
                let name = format!("labeled-data,{name},{:06}.{extension}", number + 1);
                dlc::write_frame(&mut out, Layout::Labels, &name, truth)
            }
        };
        written.expect("writing to memory cannot fail");
        out
    }

    /// Draws a picture as the sequence's camera takes it. The truth is in `shot`.
    pub(super) fn render(&self, number: u32, shot: &mut Shot) -> RgbImage {
        self.compositor().render(self.frame(number), shot);
        let [width, height] = self.shape().size_px;
        let drawn = RgbImage::without_alpha(width, height, &shot.rgba);
        self.look().take(drawn, u64::from(number))
    }
}

/// Adds a line of JSON.
fn push(out: &mut Vec<u8>, entry: &impl serde::Serialize) {
    serde_json::to_writer(&mut *out, entry).expect("writing to memory cannot fail");
    out.push(b'\n');
}
