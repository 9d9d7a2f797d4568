//! Encoding to MP4: equal frames give equal bytes, colors are kept, and an error leaves no file.

use std::path::Path;

use flockreel::media::{Encoding, Limits, Quality, Video, VideoFormat, VideoWriter};
use flockreel_core::code::Code;
use flockreel_core::footage::FrameSource;
use flockreel_core::raster::{ColorSpec, Frame, Matrix, Range};

use super::{n_processes_with, read_all};
use crate::common::film::Films;

const FORMAT: VideoFormat = VideoFormat {
    width: 96,
    height: 64,
    fps: 25.0,
    color: ColorSpec {
        matrix: Matrix::Bt601,
        range: Range::Limited,
    },
};

/// Returns a smooth picture that moves with `frame_idx`.
fn picture(format: &VideoFormat, frame_idx: usize) -> Frame {
    let mut frame = Frame::new(format.width, format.height, format.color);
    let width = format.width as usize;
    let n_luma = width * format.height as usize;
    let (luma, chroma) = frame.planes.split_at_mut(n_luma);
    for (at, value) in luma.iter_mut().enumerate() {
        let (x, y) = (at % width + frame_idx, at / width);
        *value = (60 + (x + 2 * y) % 120) as u8;
    }
    chroma.fill(120);
    frame
}

fn write(path: &Path, format: &VideoFormat, quality: Quality, n_frames: usize) -> Result<(), Code> {
    write_within(path, format, quality, n_frames, &Limits::default())
}

fn write_within(
    path: &Path,
    format: &VideoFormat,
    quality: Quality,
    n_frames: usize,
    limits: &Limits,
) -> Result<(), Code> {
    let all = || {
        let mut writer = VideoWriter::create_with(path, format, Encoding::H264(quality), limits)?;
        for frame_idx in 0..n_frames {
            writer.write(&picture(format, frame_idx))?;
        }
        writer.finish()
    };
    all().map_err(|error| error.code())
}

/// Writes a film of noise, which no encoder can compress.
fn write_noise(path: &Path, quality: Quality) -> Result<(), Code> {
    let all = || {
        let mut writer = VideoWriter::create_as(path, &FORMAT, Encoding::H264(quality))?;
        let mut state = 1u32;
        for _ in 0..100 {
            let mut frame = Frame::new(FORMAT.width, FORMAT.height, FORMAT.color);
            for value in &mut frame.planes {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *value = (state >> 24) as u8;
            }
            writer.write(&frame)?;
        }
        writer.finish()
    };
    all().map_err(|error| error.code())
}

#[test]
fn written_film_is_read_back_with_size_rate_and_colors() {
    let films = Films::new();
    for (matrix, range, fps) in [
        (Matrix::Bt601, Range::Limited, 25.0),
        (Matrix::Bt709, Range::Limited, 1e6 / 33333.0),
        (Matrix::Bt601, Range::Full, 30000.0 / 1001.0),
    ] {
        let format = VideoFormat {
            fps,
            color: ColorSpec { matrix, range },
            ..FORMAT
        };
        let path = films.path("film.mp4");
        write(&path, &format, Quality::default(), 40).expect("a film");
        let video = Video::open(&path, &Limits::default()).expect("our own film");
        assert_eq!((video.format().width, video.format().height), (96, 64));
        assert_eq!(video.format().color, format.color);
        assert!(
            (video.format().fps - fps).abs() < 1e-5,
            "{}",
            video.format().fps
        );
        let frames = read_all(&video).expect("frames");
        assert_eq!(frames.len(), 40);
        let error: u64 = frames
            .iter()
            .enumerate()
            .map(|(k, (_, frame))| {
                let wanted = picture(&format, k);
                frame
                    .planes
                    .iter()
                    .zip(&wanted.planes)
                    .map(|(a, b)| u64::from(a.abs_diff(*b)))
                    .sum::<u64>()
            })
            .sum();
        let mean = error as f64 / (40 * Frame::n_bytes(96, 64)) as f64;
        assert!(mean < 2.0, "mean error {mean}");
    }
}

#[test]
fn odd_sizes_are_padded_by_a_row_and_a_column() {
    let films = Films::new();
    let format = VideoFormat {
        width: 97,
        height: 63,
        ..FORMAT
    };
    write(&films.path("odd.mp4"), &format, Quality::default(), 10).expect("a film");
    let video = Video::open(&films.path("odd.mp4"), &Limits::default()).expect("our own film");
    assert_eq!((video.format().width, video.format().height), (98, 64));
}

#[test]
fn equal_frames_give_equal_bytes_and_the_index_comes_first() {
    let films = Films::new();
    for name in ["a.mp4", "b.mp4"] {
        write(&films.path(name), &FORMAT, Quality::default(), 60).expect("a film");
    }
    let [a, b] = ["a.mp4", "b.mp4"].map(|name| std::fs::read(films.path(name)).expect("a film"));
    assert!(a == b, "the bytes differ");
    let place = |name: &[u8]| a.windows(4).position(|w| w == name).expect("a box");
    assert!(place(b"moov") < place(b"mdat"));
    assert!(
        !a.windows(11).any(|w| w == b"x264 - core"),
        "the encoder does not name itself"
    );
}

#[test]
fn dropped_writer_leaves_neither_file_nor_child() {
    let films = Films::new();
    let path = films.path("film.mp4");
    let mut writer = VideoWriter::create(&path, &FORMAT).expect("an encoder");
    for frame_idx in 0..30 {
        writer
            .write(&picture(&FORMAT, frame_idx))
            .expect("room in the pipe");
    }
    drop(writer);
    assert_eq!(
        std::fs::read_dir(films.folder())
            .expect("the folder")
            .count(),
        0
    );
    assert_eq!(n_processes_with(&films.folder().display().to_string()), 0);
}

#[test]
fn older_file_is_kept_until_the_new_one_is_complete() {
    let films = Films::new();
    let path = films.write("film.mp4", "older");
    drop(VideoWriter::create(&path, &FORMAT).expect("an encoder"));
    assert_eq!(std::fs::read(&path).expect("the older file"), b"older");
    write(&path, &FORMAT, Quality::default(), 5).expect("a film");
    assert!(std::fs::read(&path).expect("the newer file").len() > 500);
}

#[test]
fn too_large_video_is_storage_full_and_leaves_no_file() {
    let films = Films::new();
    let limits = Limits {
        max_output_bytes: 20_000,
        ..Limits::default()
    };
    let large = Quality {
        crf: 1,
        ..Quality::default()
    };
    let code = write_within(&films.path("film.mp4"), &FORMAT, large, 400, &limits);
    assert_eq!(code, Err(Code::StorageFull));
    assert_eq!(
        std::fs::read_dir(films.folder())
            .expect("the folder")
            .count(),
        0
    );
}

#[test]
fn full_disk_is_storage_full_and_leaves_no_file() {
    let films = Films::new();
    let disk = films.path("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let mount = |program: &str, args: &[&str]| {
        let done = std::process::Command::new(program)
            .args(args)
            .arg(&disk)
            .output();
        done.is_ok_and(|done| done.status.success())
    };
    if !mount("mount", &["-t", "tmpfs", "-o", "size=64k", "none"]) {
        println!("skipped: no small disk can be mounted here");
        return;
    }
    let large = Quality {
        crf: 1,
        ..Quality::default()
    };
    let code = write_noise(&disk.join("film.mp4"), large);
    let n_left = std::fs::read_dir(&disk).expect("the disk").count();
    assert!(mount("umount", &[]), "the disk stays mounted");
    assert_eq!((code, n_left), (Err(Code::StorageFull), 0));
}

#[test]
fn frame_of_another_size_is_refused() {
    let films = Films::new();
    let mut writer = VideoWriter::create(&films.path("film.mp4"), &FORMAT).expect("an encoder");
    let error = writer
        .write(&Frame::new(64, 64, FORMAT.color))
        .expect_err("another size");
    assert_eq!(error.code(), Code::Internal);
}
