//! Small real video files, made once per test program: the virtual fish, filmed and encoded.

use std::sync::LazyLock;

use flockreel::fish::sample::{SampleFilm, SampleParams};
use flockreel::footage::FrameSource;
use flockreel::media::{VideoFormat, VideoWriter};
use flockreel::raster::Frame;

/// Ten frames of 64x64: enough to be admitted.
pub(crate) static TINY: LazyLock<Vec<u8>> = LazyLock::new(|| film(10, 64, 64));

/// Ten seconds of 320x240: enough for a library with transitions.
pub(crate) static SWIM: LazyLock<Vec<u8>> = LazyLock::new(|| film(300, 320, 240));

fn film(n_frames: usize, width: u32, height: u32) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mp4");
    let params = SampleParams {
        n_frames,
        width,
        height,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).unwrap();
    let (fps, color) = (film.format().fps, film.format().color);
    let format = VideoFormat {
        width,
        height,
        fps,
        color,
    };
    let mut writer = VideoWriter::create(&path, &format).unwrap();
    let (mut stream, mut frame) = (film.open().unwrap(), Frame::default());
    while stream.next_frame(&mut frame).unwrap().is_some() {
        writer.write(&frame).unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}
