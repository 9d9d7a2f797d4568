//! Small video files of the virtual fish. Each is rendered and encoded once per test program.

use std::sync::LazyLock;

use flockreel::media::VideoWriter;
use flockreel_core::fish::film::Film;
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::footage::{FootageFormat, FrameSource};
use flockreel_core::raster::{Frame, RgbImage};

/// Ten frames of 64 x 64 pixels, enough to be admitted as footage.
pub(crate) static TINY: LazyLock<Vec<u8>> = LazyLock::new(|| film(10, 64, 64));

/// Ten seconds (300 frames) of 320 x 240 pixels, enough for a library with transitions.
pub(crate) static SWIM: LazyLock<Vec<u8>> = LazyLock::new(|| film(300, 320, 240));

/// The mask film of `SWIM`: each pixel is the alpha of the fish, 0 to 255.
pub(crate) static SWIM_MASKS: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let params = SampleParams {
        n_frames: 300,
        width: 320,
        height: 240,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).unwrap();
    let fish = Film::new(film.motion().clone(), film.background().clone());
    encoded(&film.format(), |k, frame| {
        let drawing = fish.draw(k);
        let mut picture = RgbImage::new(frame.width, frame.height);
        for y in 0..drawing.rect.h {
            for x in 0..drawing.rect.w {
                let level = (255.0 * drawing.alpha(x, y)) as u8;
                let at = [drawing.rect.x + x, drawing.rect.y + y];
                picture.set_pixel(at[0], at[1], [level; 3]);
            }
        }
        frame.draw_all_rgb(&picture);
    })
});

fn film(n_frames: usize, width: u32, height: u32) -> Vec<u8> {
    let params = SampleParams {
        n_frames,
        width,
        height,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).unwrap();
    encoded(&film.format(), |k, frame| film.render(k, frame))
}

/// Returns the bytes of an MP4 file whose frames are drawn by `draw`.
fn encoded(format: &FootageFormat, draw: impl Fn(usize, &mut Frame)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mp4");
    let mut writer = VideoWriter::create(&path, &(*format).into()).unwrap();
    let mut frame = Frame::new(format.width, format.height, format.color);
    for k in 0..format.n_frames_hint {
        draw(k, &mut frame);
        writer.write(&frame).unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}
