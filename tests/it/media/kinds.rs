//! Output files other than MP4: size, frame rate and color tags are right, and colors and alpha are kept
//! (docs/explanation/algorithms.md, "Compositing").

use std::path::Path;
use std::process::Command;

use flockreel::media::{Encoding, VideoFormat, VideoWriter};
use flockreel_core::raster::{ColorSpec, Frame};

use crate::common::film::Films;

const N_FRAMES: usize = 12;
const FORMAT: VideoFormat = VideoFormat {
    width: 98,
    height: 66,
    fps: 30000.0 / 1001.0,
    color: ColorSpec {
        matrix: flockreel_core::raster::Matrix::Bt601,
        range: flockreel_core::raster::Range::Limited,
    },
};

/// Returns a moving orange disk with a soft edge, as RGBA with straight alpha: the color continues where
/// alpha is 0.
fn disc(frame_idx: usize) -> Vec<u8> {
    let center = [30.0 + 3.0 * frame_idx as f64, 33.0];
    (0..98 * 66)
        .flat_map(|k| {
            let (x, y) = (f64::from(k % 98) - center[0], f64::from(k / 98) - center[1]);
            let alpha = (20.5 - x.hypot(y)).clamp(0.0, 4.0) / 4.0;
            [230, 120, 40, (255.0 * alpha).round() as u8]
        })
        .collect()
}

fn written(films: &Films, name: &str, coding: Encoding) -> std::path::PathBuf {
    let path = films.path(name);
    let mut writer = VideoWriter::create_as(&path, &FORMAT, coding).expect("an encoder");
    for frame_idx in 0..N_FRAMES {
        if coding.takes_rgba() {
            writer.write_rgba(&disc(frame_idx)).expect("it takes RGBA");
        } else {
            let mut frame = Frame::new(98, 66, FORMAT.color);
            frame.planes.fill(128);
            frame.planes[frame_idx * 98..][..98].fill(20);
            writer.write(&frame).expect("it takes planes");
        }
    }
    writer.finish().expect("a whole file");
    path
}

/// Returns the lines that ffprobe prints about the first stream.
fn said(path: &Path, entries: &str) -> Vec<String> {
    let done = Command::new("ffprobe")
        .args(["-v", "error", "-count_frames", "-of", "default=nw=1"])
        .args(["-show_entries", entries])
        .arg(path)
        .output()
        .expect("ffprobe is installed");
    let text = String::from_utf8(done.stdout).expect("it is text");
    text.lines().map(str::to_owned).collect()
}

#[test]
fn written_files_have_size_rate_and_color_tags() {
    let films = Films::new();
    for (name, coding) in [
        ("a.webm", Encoding::Vp9 { alpha: true }),
        ("b.webm", Encoding::Vp9 { alpha: false }),
        ("a.mov", Encoding::ProRes { alpha: true }),
        ("b.mov", Encoding::ProRes { alpha: false }),
    ] {
        let path = written(&films, name, coding);
        let entries = "stream=width,height,avg_frame_rate,nb_read_frames,color_range,color_space,\
                       color_transfer,color_primaries:stream_tags=alpha_mode";
        let said = said(&path, entries);
        for wanted in [
            "width=98",
            "height=66",
            "nb_read_frames=12",
            "color_range=tv",
            "color_space=bt709",
            "color_transfer=bt709",
            "color_primaries=bt709",
        ] {
            assert!(
                said.iter().any(|line| line == wanted),
                "{name}: {wanted} {said:?}"
            );
        }
        let rate = said
            .iter()
            .find_map(|line| line.strip_prefix("avg_frame_rate="));
        let (over, under) = rate.expect("a rate").split_once('/').expect("a fraction");
        let fps = over.parse::<f64>().unwrap() / under.parse::<f64>().unwrap();
        assert!((fps - FORMAT.fps).abs() < 0.15, "{name}: {fps}");
        let tagged = said.contains(&"TAG:alpha_mode=1".to_owned());
        assert_eq!(tagged, name == "a.webm", "{said:?}");
    }
}

#[test]
fn alpha_is_read_back_without_dark_edges() {
    let films = Films::new();
    for (name, coding, decoder, most) in [
        ("a.webm", Encoding::Vp9 { alpha: true }, "libvpx-vp9", 3.0),
        ("a.mov", Encoding::ProRes { alpha: true }, "prores", 0.6),
    ] {
        written(&films, name, coding);
        let args = format!("-c:v {decoder} -i {name} -pix_fmt rgba -f rawvideo back.raw");
        let back = std::fs::read(films.run(&args)).expect("frames");
        assert_eq!(back.len(), N_FRAMES * 98 * 66 * 4, "{name}");
        let (mut error, mut n) = (0.0, 0.0);
        for (frame_idx, picture) in back.chunks_exact(98 * 66 * 4).enumerate() {
            for (found, given) in picture.chunks_exact(4).zip(disc(frame_idx).chunks_exact(4)) {
                error += f64::from(found[3].abs_diff(given[3]));
                n += 1.0;
                if given[3] > 40 {
                    let off = (0..3).map(|k| found[k].abs_diff(given[k])).max();
                    assert!(off < Some(14), "{name}: {found:?} {given:?}");
                }
            }
        }
        assert!(
            error / n < most,
            "{name}: mean error of alpha {}",
            error / n
        );
    }
}

#[test]
fn previews_are_small_animated_and_loop() {
    let films = Films::new();
    let gif = written(&films, "a.gif", Encoding::Gif);
    let counted = said(&gif, "stream=nb_read_frames,width,height");
    // 12 frames at 29.97 frames/s last 0.4 s, which gives six frames at 15 frames/s.
    assert!(
        counted.contains(&"nb_read_frames=6".to_owned()),
        "{counted:?}"
    );
    assert!(counted.contains(&"width=98".to_owned()), "{counted:?}");
    let webp = std::fs::read(written(&films, "a.webp", Encoding::Webp)).expect("a file");
    assert_eq!((&webp[..4], &webp[8..12]), (&b"RIFF"[..], &b"WEBP"[..]));
    let n_frames = webp.windows(4).filter(|w| w == b"ANMF").count();
    assert!((5..=7).contains(&n_frames), "{n_frames}");
}

#[test]
fn equal_frames_give_equal_bytes_in_every_format() {
    let films = Films::new();
    for coding in [
        Encoding::Vp9 { alpha: true },
        Encoding::ProRes { alpha: true },
        Encoding::Webp,
        Encoding::Gif,
    ] {
        let [a, b] = ["a", "b"].map(|name| std::fs::read(written(&films, name, coding)).unwrap());
        assert!(a == b, "{coding:?}");
    }
}

#[test]
fn frames_of_the_wrong_kind_are_refused() {
    let films = Films::new();
    let coding = Encoding::ProRes { alpha: true };
    let mut writer = VideoWriter::create_as(&films.path("a.mov"), &FORMAT, coding).unwrap();
    assert!(writer.write(&Frame::new(98, 66, FORMAT.color)).is_err());
    assert!(writer.write_rgba(&disc(0)[4..]).is_err());
    let mut writer = VideoWriter::create(&films.path("a.mp4"), &FORMAT).unwrap();
    assert!(writer.write_rgba(&disc(0)).is_err());
}
