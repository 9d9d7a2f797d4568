//! Measures the time to read and write a film, against plain ffmpeg. Run by hand on a quiet machine.

use std::process::Command;
use std::time::Instant;

use flockreel::media::{Limits, Video, VideoWriter};
use flockreel_core::footage::FrameSource;
use flockreel_core::raster::Frame;

use crate::common::film::Films;

#[test]
#[ignore = "measures: run it alone, with --nocapture"]
fn reading_and_writing_against_plain_ffmpeg() {
    let films = Films::new();
    let film = films.test_picture("640x480", 1200, "-c:v libx264 -pix_fmt yuv420p film.mp4");
    for _ in 0..3 {
        let null = seconds(|| plain(&format!("-i {} -f null -", film.display())));
        let rgb = format!(
            "-i {} -pix_fmt rgb24 -f rawvideo -y /dev/null",
            film.display()
        );
        let rgb = seconds(|| plain(&rgb));
        let start = Instant::now();
        let video = Video::open(&film, &Limits::default()).expect("a good film");
        let open = start.elapsed().as_secs_f64();
        let read = seconds(|| {
            let mut stream = FrameSource::open(&video).expect("a decoder");
            let mut frame = Frame::default();
            while stream.next_frame(&mut frame).expect("a frame").is_some() {}
        });
        let write = seconds(|| write(&films, &video));
        println!(
            "ffmpeg to null {null:.3} s, to rgb24 {rgb:.3} s; open {open:.3} s, read {read:.3} s, \
             read and write 400 frames {write:.3} s"
        );
    }
}

fn write(films: &Films, video: &Video) {
    let mut writer =
        VideoWriter::create(&films.path("out.mp4"), &video.format().into()).expect("an encoder");
    let mut stream = FrameSource::open(video).expect("a decoder");
    let mut frame = Frame::default();
    for _ in 0..400 {
        stream.next_frame(&mut frame).expect("a frame");
        writer.write(&frame).expect("room");
    }
    writer.finish().expect("a film");
}

fn plain(args: &str) {
    let args = args.split_whitespace();
    let done = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error"])
        .args(args)
        .status();
    assert!(done.expect("ffmpeg is installed").success());
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}
