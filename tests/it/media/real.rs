//! Real recordings are decoded completely, with the expected size, frame rate and number of frames.
//! FLOCKREEL_FOOTAGE names the folder of recordings, which are not in the repository.

use flockreel::media::{Limits, Video};
use flockreel_core::footage::FrameSource;
use flockreel_core::raster::{Frame, Range};

use crate::common::film::footage;

#[test]
fn real_clips_decode_at_their_size_and_rate() {
    let Some(folder) = footage() else { return };
    for (name, width, height, fps, n_frames) in [
        ("mouse_openfield.mp4", 640, 480, 1e6 / 33333.0, 1200),
        ("mouse_round_arena.webm", 640, 480, 30.0, 1200),
        ("zebra_finch_cage.mp4", 1280, 720, 25.0, 497),
        ("zebrafish_larva_single.mkv", 210, 80, 25.0, 385),
        ("zebrafish_juvenile_single.avi", 260, 110, 30.0, 96),
        ("flies_pair.mp4", 1024, 1024, 25.0, 1000),
        ("spider_web_tiny.mp4", 1920, 1080, 60.0, 1442),
    ] {
        let video = Video::open(&folder.join(name), &Limits::default()).expect(name);
        let format = video.format();
        assert_eq!((format.width, format.height), (width, height), "{name}");
        assert!((format.fps - fps).abs() < 1e-6, "{name}: {}", format.fps);
        assert_eq!(format.n_frames_hint, n_frames, "{name}");
        let full = name.starts_with("zebrafish");
        assert_eq!(format.color.range == Range::Full, full, "{name}");
        // Two of the clips were cut without re-encoding, so their last frame is late.
        let (mut stream, mut frame) = (FrameSource::open(&video).expect(name), Frame::default());
        let mut n_read = 0;
        while let Some(time_s) = stream.next_frame(&mut frame).expect(name) {
            assert!(
                (time_s - n_read as f64 / fps).abs() < 0.08,
                "{name} {n_read}: {time_s}"
            );
            n_read += 1;
        }
        assert_eq!(n_read, n_frames, "{name}");
    }
}
