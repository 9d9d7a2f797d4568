//! Films of every accepted container and codec: all frames, upright, with square pixels, at a constant rate.

use std::ops::ControlFlow;

use flockreel::media::Limits;
use flockreel_core::footage::{FrameSource, spread_idx};
use flockreel_core::raster::{Frame, Matrix, Range};

use super::{open, read_all, read_whole};
use crate::common::film::Films;

#[test]
fn accepted_codecs_give_all_frames() {
    let films = Films::new();
    for (codec, name) in [
        ("libx264 -pix_fmt yuv420p", "a.mp4"),
        ("libx265 -x265-params log-level=none", "b.mp4"),
        (
            "libvpx -deadline realtime -auto-alt-ref 1 -lag-in-frames 8",
            "c.webm",
        ),
        ("libvpx-vp9 -deadline realtime -cpu-used 8", "d.webm"),
        ("libsvtav1 -preset 12", "e.mp4"),
        ("mpeg4", "f.avi"),
        ("mpeg2video", "g.ts"),
        ("mjpeg -pix_fmt yuvj420p", "h.avi"),
        ("prores_ks", "i.mov"),
        ("ffv1", "j.mkv"),
        ("rawvideo -pix_fmt yuv420p", "k.avi"),
        ("wmv2", "l.asf"),
        ("libx264 -pix_fmt yuv420p -bf 2", "m.ts"),
        (
            "libx264 -pix_fmt yuv420p -bf 2 -f mpegts -mpegts_m2ts_mode 1",
            "n.m2ts",
        ),
        ("libx264 -pix_fmt yuv420p", "o.3gp"),
        ("h263 -s 176x144", "p.3gp"),
        ("mpeg1video", "q.mpg"),
        ("mpeg2video -bf 2", "r.mpg"),
        ("libtheora", "s.ogv"),
        ("flv", "t.flv"),
        ("libx264 -pix_fmt yuv420p", "u.flv"),
        ("libx264 -pix_fmt yuv420p -bf 2", "v.h264"),
        ("libx265 -x265-params log-level=none", "w.hevc"),
        ("ffv1 -pix_fmt bgr0", "a.avi"),
        ("huffyuv -pix_fmt yuv422p", "b.avi"),
        ("huffyuv -pix_fmt rgb24", "c.avi"),
        ("ffvhuff -pix_fmt yuv420p", "d.avi"),
        ("png -pix_fmt rgb24", "e.avi"),
        ("png -pix_fmt gray", "g.avi"),
        ("rawvideo -pix_fmt bgr24", "i.avi"),
        ("rawvideo -pix_fmt gray", "j.avi"),
        ("rawvideo -pix_fmt pal8", "l.avi"),
        ("libx264 -pix_fmt yuv420p -bf 2", "m.avi"),
    ] {
        let film = films.test_picture("128x96", 40, &format!("-c:v {codec} {name}"));
        let n_frames = read_whole(&film, &Limits::default()).map(|frames| frames.len());
        assert_eq!(n_frames, Ok(40), "{name} {codec}");
    }
}

#[test]
fn frames_equal_those_of_plain_ffmpeg() {
    let films = Films::new();
    let film = films.test_picture("130x98", 30, "-c:v libx264 -pix_fmt yuv420p film.mp4");
    let reference = films.reference(&film, "-pix_fmt yuv420p");
    let frames = read_whole(&film, &Limits::default()).expect("a good film");
    let planes: Vec<u8> = frames
        .into_iter()
        .flat_map(|(_, frame)| frame.planes)
        .collect();
    assert!(planes == reference, "the bytes differ");
}

#[test]
fn spread_frames_equal_those_of_a_full_read() {
    let films = Films::new();
    for options in [
        "-bf 2",
        "-bf 2 -vf setpts='PTS+floor(N/7)*0.2/TB' -fps_mode vfr",
    ] {
        let film = films.test_picture("128x96", 50, &format!("-c:v libx264 {options} f.mp4"));
        let whole = read_whole(&film, &Limits::default()).expect("a good film");
        let mut spread = Vec::new();
        let visit = &mut |frame: &Frame| {
            spread.push(frame.clone());
            ControlFlow::Continue(())
        };
        open(&film).spread(7, visit).expect("a good film");
        let wanted: Vec<Frame> = spread_idx(whole.len(), 7)
            .into_iter()
            .map(|idx| whole[idx].1.clone())
            .collect();
        assert!(spread == wanted, "{options}");
    }
}

#[test]
fn spread_frames_of_a_reduced_film_are_the_right_ones() {
    let films = Films::new();
    let film = films.test_picture("128x96", 200, "-c:v libx264 -bf 2 f.mp4");
    let mut video = open(&film);
    assert_eq!(video.reduce(64), 0.5);
    let format = video.format();
    assert_eq!([format.width, format.height], [64, 48]);
    let whole = read_all(&video).expect("a good film");
    let mut spread = Vec::new();
    let visit = &mut |frame: &Frame| {
        spread.push(frame.clone());
        ControlFlow::Continue(())
    };
    video.spread(7, visit).expect("a good film");
    let wanted = spread_idx(whole.len(), 7).into_iter();
    let wanted: Vec<Frame> = wanted.map(|idx| whole[idx].1.clone()).collect();
    assert!(spread == wanted);
    assert_eq!(open(&film).reduce(128), 1.0, "it is small enough");
}

#[test]
fn camera_orientations_are_undone() {
    let films = Films::new();
    films.test_picture("128x96", 5, "-c:v libx264 -pix_fmt yuv420p upright.mp4");
    for degrees in [90, 180, 270] {
        let film = films.run(&format!(
            "-i upright.mp4 -c copy -metadata:s:v rotate={degrees} turned.mp4"
        ));
        let reference = films.reference(&film, "-pix_fmt yuv420p");
        let frames = read_whole(&film, &Limits::default()).expect("a good film");
        let (width, height) = if degrees == 180 { (128, 96) } else { (96, 128) };
        assert_eq!((frames[0].1.width, frames[0].1.height), (width, height));
        let planes: Vec<u8> = frames
            .into_iter()
            .flat_map(|(_, frame)| frame.planes)
            .collect();
        assert!(planes == reference, "{degrees} degrees: the bytes differ");
    }
}

#[test]
fn pixels_become_square() {
    let films = Films::new();
    let args = "-c:v libx264 -pix_fmt yuv420p";
    let wide = films.test_picture("120x96", 5, &format!("-vf setsar=4/3 {args} wide.mp4"));
    let high = films.test_picture("120x96", 5, &format!("-vf setsar=1/2 {args} high.mp4"));
    let size = |film| (open(film).format().width, open(film).format().height);
    assert_eq!(size(&wide), (160, 96));
    assert_eq!(size(&high), (120, 192));
    assert_eq!(read_all(&open(&wide)).expect("frames").len(), 5);
}

#[test]
fn gray_and_full_range_films_keep_their_values() {
    let films = Films::new();
    let grey = films.test_picture("64x48", 4, "-pix_fmt gray -c:v ffv1 grey.mkv");
    let tagged = films.test_picture("64x48", 4, "-c:v libx264 -pix_fmt yuvj420p full.mp4");
    for (film, reference) in [
        (grey, "-pix_fmt gray"),
        (tagged, "-vf extractplanes=y -pix_fmt gray"),
    ] {
        let video = open(&film);
        assert_eq!(video.format().color.range, Range::Full);
        let reference = films.reference(&film, reference);
        let frames = read_all(&video).expect("frames");
        let luma: Vec<u8> = frames
            .iter()
            .flat_map(|(_, frame)| frame.luma().to_vec())
            .collect();
        assert!(luma == reference, "{film:?}: the luma differs");
    }
}

#[test]
fn luma_weights_follow_the_tag_and_rgb_becomes_601() {
    let films = Films::new();
    let matrix = |args: &str| {
        open(&films.test_picture("64x48", 4, args))
            .format()
            .color
            .matrix
    };
    let h264 = "-c:v libx264 -pix_fmt yuv420p";
    assert_eq!(
        matrix(&format!("{h264} -colorspace bt709 a.mp4")),
        Matrix::Bt709
    );
    assert_eq!(
        matrix(&format!("{h264} -colorspace smpte170m b.mp4")),
        Matrix::Bt601
    );
    assert_eq!(matrix(&format!("{h264} c.mp4")), Matrix::Bt601);
    assert_eq!(matrix("-c:v ffv1 -pix_fmt bgr0 d.mkv"), Matrix::Bt601);
    // Pure red stays red in a film that stores RGB.
    let red =
        films.run("-f lavfi -i color=red:size=64x48 -frames:v 3 -c:v ffv1 -pix_fmt bgr0 red.mkv");
    let frames = read_all(&open(&red)).expect("frames");
    let [r, g, b] = frames[0].1.to_rgb().pixel(30, 20);
    assert!(r >= 252 && g <= 3 && b <= 3, "{r} {g} {b}");
}

#[test]
fn varying_rate_becomes_constant_with_true_times() {
    let films = Films::new();
    // One of ten frames is missing: times 0, 1, 2, 3, 5, ... in steps of 1/25 s.
    let film = films.test_picture(
        "64x48",
        36,
        "-vf select=not(eq(mod(n\\,10)\\,4)) -fps_mode vfr -c:v libx264 -pix_fmt yuv420p wander.mkv",
    );
    let video = open(&film);
    assert!(
        (video.format().fps - 25.0).abs() < 1e-9,
        "{}",
        video.format().fps
    );
    let frames = read_all(&video).expect("frames");
    assert_eq!(frames.len(), video.format().n_frames_hint);
    assert_eq!(frames.len(), 40);
    assert!(
        frames[3].1 == frames[4].1,
        "the missing frame is its earlier neighbor"
    );
    assert!((frames[4].0 - 0.12).abs() < 1e-3, "{}", frames[4].0);
    assert!((frames[5].0 - 0.20).abs() < 1e-3, "{}", frames[5].0);
}

#[test]
fn picture_of_another_size_does_not_shift_later_frames() {
    let films = Films::new();
    let args = "-c:v libx264 -pix_fmt yuv420p -bf 0";
    let first = films.test_picture("128x96", 20, &format!("{args} first.ts"));
    let second = films.test_picture(
        "64x128",
        20,
        &format!("{args} -output_ts_offset 0.8 second.ts"),
    );
    let bytes = [first, second]
        .map(|film| std::fs::read(film).expect("a part"))
        .concat();
    let film = films.write("both.ts", bytes);
    let frames = read_whole(&film, &Limits::default()).expect("a film of two sizes");
    assert_eq!(frames.len(), 40);
    assert!(
        frames
            .iter()
            .all(|(_, frame)| (frame.width, frame.height) == (128, 96))
    );
    let again = read_whole(&film, &Limits::default()).expect("the same");
    assert!(frames == again);
}

#[test]
fn interlaced_films_give_one_frame_for_two_fields() {
    let films = Films::new();
    let film = films.test_picture(
        "128x96",
        20,
        "-c:v libx264 -pix_fmt yuv420p -flags +ilme+ildct -x264-params tff=1 fields.mkv",
    );
    assert_eq!(
        read_whole(&film, &Limits::default()).map(|frames| frames.len()),
        Ok(20)
    );
}
