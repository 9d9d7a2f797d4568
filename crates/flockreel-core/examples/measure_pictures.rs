//! Measures an animal in a folder of pictures and writes its library: poses.json, mattes.zip and more.
//!
//!     cargo run --release -p flockreel-core --example measure_pictures PICTURES_DIR LIBRARY_DIR [FPS]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flockreel_core::analysis::{Params, analyze};
use flockreel_core::code::Code;
use flockreel_core::cpu;
use flockreel_core::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use flockreel_core::formats::library_dir;
use flockreel_core::formats::library_json::FootageSummary;
use flockreel_core::progress::Silent;
use flockreel_core::raster::{ColorSpec, Frame, RgbImage};
use flockreel_core::scratch::{InMemory, Scratch};

/// Pictures of equal size, in the order of their names.
struct Pictures {
    files: Vec<PathBuf>,
    format: FootageFormat,
}

impl Pictures {
    fn open(folder: &Path, fps: f64) -> Result<Pictures, Box<dyn Error>> {
        let entries = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
        let mut files: Vec<PathBuf> = entries.iter().map(std::fs::DirEntry::path).collect();
        files.sort();
        let first = files.first().ok_or("the folder is empty")?;
        let (width, height) = image::image_dimensions(first)?;
        let format = FootageFormat {
            width,
            height,
            fps,
            n_frames_hint: files.len(),
            color: ColorSpec::default(),
        };
        Ok(Pictures { files, format })
    }
}

impl FrameSource for Pictures {
    fn format(&self) -> FootageFormat {
        self.format
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(Reader {
            pictures: self,
            next: 0,
        }))
    }
}

struct Reader<'a> {
    pictures: &'a Pictures,
    next: usize,
}

impl FrameStream for Reader<'_> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        let Some(file) = self.pictures.files.get(self.next) else {
            return Ok(None);
        };
        let picture = image::open(file).map_err(|cause| SourceError {
            code: Code::NotAVideo,
            cause: cause.into(),
        })?;
        let FootageFormat {
            width,
            height,
            fps,
            color,
            ..
        } = self.pictures.format;
        *frame = Frame::new(width, height, color);
        frame.draw_all_rgb(&RgbImage {
            width,
            height,
            pixels: picture.to_rgb8().into_raw(),
        });
        self.next += 1;
        Ok(Some((self.next - 1) as f64 / fps))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [folder, library_dir, rest @ ..] = &args[..] else {
        return Err("usage: measure_pictures PICTURES_DIR LIBRARY_DIR [FPS]".into());
    };
    let fps = rest.first().map_or(Ok(25.0), |fps| fps.parse())?;
    let pictures = Pictures::open(Path::new(folder), fps)?;
    let params = Params::default();
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let level = cpu::Level::detect();
    let library = analyze(&pictures, None, &params, level, &scratch, &Silent)?;
    let source = FootageSummary {
        sha256: String::new(),
        n_bytes: 0,
    };
    library_dir::write(Path::new(library_dir), &library, &params, &source)?;
    println!(
        "{} of {} frames show the animal; {} transitions",
        library.stats.n_detected, library.stats.n_frames, library.stats.n_transitions
    );
    Ok(())
}
