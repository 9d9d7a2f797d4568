//! Films with misleading headers, clocks or streams: the actual pictures count, not the claims.

use std::path::Path;

use flockreel::media::{Limits, Notice, ReadOptions, Video};
use flockreel_core::code::Code;
use flockreel_core::footage::FrameSource;

use super::{open, read_all, read_whole};
use crate::common::film::Films;

const H264: &str = "-c:v libx264 -pix_fmt yuv420p";

/// Returns the frame rate and the number of frames. Asserts that the frames equal those of plain ffmpeg.
fn read(films: &Films, film: &Path) -> (f64, usize) {
    let video = open(film);
    let frames = read_all(&video).expect("frames");
    let reference = films.reference(film, "-fps_mode passthrough -pix_fmt yuv420p");
    let planes: Vec<u8> = frames.iter().flat_map(|(_, f)| f.planes.clone()).collect();
    assert!(planes == reference, "{film:?}: the frames differ");
    (video.format().fps, frames.len())
}

#[test]
fn sound_longer_than_the_pictures_is_no_cut() {
    let films = Films::new();
    let picture = "-f lavfi -i testsrc2=size=64x48:rate=25:d=2,noise=alls=20:allf=t -f lavfi -i sine=d=4 -map 0 -map 1";
    for args in [
        "-c:v wmv2 -c:a wmav2 a.wmv",
        "-c:v wmv2 -c:a wmav2 a.asf",
        "-c:v libx264 -pix_fmt yuv420p -bf 2 -c:a pcm_s16le b.avi",
        "-c:v mpeg1video -c:a mp2 c.mpg",
        "-c:v mpeg2video -bf 2 -c:a mp2 d.mpg",
        "-c:v flv -ar 44100 -c:a mp3 e.flv",
        "-c:v libtheora -c:a libvorbis f.ogv",
        "-c:v libx264 -pix_fmt yuv420p -c:a aac g.mp4",
        "-c:v libx264 -pix_fmt yuv420p -c:a aac h.mkv",
        "-c:v libx264 -pix_fmt yuv420p -c:a aac i.ts",
    ] {
        let film = films.run(&format!("{picture} {args}"));
        let (fps, n_frames) = read(&films, &film);
        assert!(
            (fps - 25.0).abs() < 1e-6 && n_frames == 50,
            "{args}: {n_frames} at {fps}"
        );
    }
}

#[test]
fn avi_header_that_counts_ticks_is_no_cut() {
    let films = Films::new();
    // The time base has two ticks per frame. Empty chunks fill every second tick.
    films.test_picture("64x48", 40, &format!("{H264} -bf 2 even.mp4"));
    let ticking = films.run("-i even.mp4 -c copy -r 50 ticking.avi");
    let (fps, n_frames) = read(&films, &ticking);
    assert!(
        (fps - 25.0).abs() < 1e-6 && n_frames == 40,
        "{n_frames} at {fps}"
    );
    // Empty chunks mark dropped frames, and the remaining pictures keep their times.
    let film = films.test_picture(
        "64x48",
        36,
        "-vf select=not(eq(mod(n\\,10)\\,4)) -fps_mode passthrough -c:v mjpeg -pix_fmt yuvj420p gaps.avi",
    );
    let frames = read_all(&open(&film)).expect("frames");
    assert_eq!(frames.len(), 40);
    assert!(frames[3].1 == frames[4].1);
    assert!((frames[5].0 - 0.2).abs() < 1e-6, "{}", frames[5].0);
}

#[test]
fn edit_list_selects_the_frames() {
    let films = Films::new();
    films.test_picture("64x48", 100, &format!("{H264} -g 25 long.mp4"));
    let part = films.run("-ss 1.5 -i long.mp4 -t 2 -c copy part.mp4");
    let n_frames = read_whole(&part, &Limits::default()).map(|frames| frames.len());
    assert!((48..=52).contains(&n_frames.expect("a good film")));
}

#[test]
fn stalls_and_clock_changes_keep_each_picture_once() {
    let films = Films::new();
    films.test_picture("64x48", 80, &format!("{H264} -bf 0 even.mp4"));
    let clocks = [
        ("N*40+gte(N\\,40)*3600000", 1),
        ("N*40+gte(N\\,40)*5000", 1),
        // After a stall, twenty pictures are written at once.
        ("if(between(N\\,30\\,49)\\,49*40+(N-49)*2\\,N*40)", 0),
        // The clock stops for twenty pictures.
        ("if(between(N\\,30\\,49)\\,1200\\,N*40)", 0),
    ];
    for (clock, n_notes) in clocks {
        let film = films.run(&format!(
            "-i even.mp4 -c copy -bsf:v setts=ts={clock}:time_base=1/1000 clock.mkv"
        ));
        let (fps, n_frames) = read(&films, &film);
        assert!(
            (fps - 25.0).abs() < 0.6 && n_frames == 80,
            "{clock}: {n_frames} at {fps}"
        );
        assert_eq!(open(&film).notices().len(), n_notes, "{clock}");
    }
    let bytes = [
        "-output_ts_offset 100 late.ts",
        "-output_ts_offset 0 early.ts",
    ]
    .map(|args| films.test_picture("64x48", 40, &format!("{H264} {args}")))
    .map(|film| std::fs::read(film).expect("a part"));
    for (name, order) in [("back.ts", [0, 1]), ("ahead.ts", [1, 0])] {
        let film = films.write(name, order.map(|k| bytes[k].clone()).concat());
        let (fps, n_frames) = read(&films, &film);
        assert!(
            (fps - 25.0).abs() < 0.1 && n_frames == 80,
            "{name}: {n_frames} at {fps}"
        );
        assert!(
            matches!(open(&film).notices(), [Notice::TimesLeap { n_leaps: 1, at_s, .. }] if (at_s - 1.56).abs() < 0.05),
            "{name}: {:?}",
            open(&film).notices()
        );
    }
}

#[test]
fn stream_with_the_most_pictures_is_read() {
    let films = Films::new();
    films.test_picture("128x96", 1, "-c:v mjpeg -pix_fmt yuvj420p thumb.jpg");
    films.test_picture("64x48", 40, &format!("{H264} film.mp4"));
    films.test_picture("64x48", 40, "-c:v wmv2 film.wmv");
    for args in [
        "-i thumb.jpg -i film.mp4 -map 0 -map 1 -c copy a.mp4",
        "-i film.mp4 -i thumb.jpg -map 0 -map 1 -c copy b.mp4",
        "-i thumb.jpg -i film.wmv -map 0 -map 1 -c copy c.wmv",
        "-i thumb.jpg -i film.mp4 -map 0 -map 1 -c copy -disposition:v:0 attached_pic d.mp4",
        "-i thumb.jpg -i film.mp4 -map 0 -map 1 -c copy e.mkv",
        "-i film.mp4 -i thumb.jpg -map 0 -map 1 -c copy -disposition:v:0 attached_pic f.mkv",
    ] {
        let video = open(&films.run(args));
        let format = video.format();
        let found = (
            format.width,
            format.n_frames_hint,
            read_all(&video).expect("frames").len(),
        );
        assert_eq!(found, (64, 40, 40), "{args}");
    }
}

#[test]
fn cut_after_the_pictures_gives_a_notice_and_cut_inside_is_refused() {
    let films = Films::new();
    let film =
        "-f lavfi -i testsrc2=size=64x48:rate=25:d=2 -f lavfi -i sine=d=4 -map 0 -map 1 -c:a aac";
    let indexed = films.run(&format!("{film} {H264} back.mp4"));
    let bytes = std::fs::read(&indexed).expect("the film");
    let find = |name: &[u8], nth: usize| {
        let places = bytes.windows(4).enumerate().filter(|(_, w)| *w == name);
        places.map(|(at, _)| at - 4).nth(nth).expect("such a box")
    };
    let notes = |path: &Path| {
        let video = open(path);
        assert_eq!(read_all(&video).expect("frames").len(), 50, "{path:?}");
        video.notices().to_vec()
    };
    assert_eq!(notes(&indexed), []);
    let whole_picture = [Notice::CutAfterPictures { n_pictures: 50 }];
    for (name, end) in [
        ("no-sound.mp4", find(b"trak", 1)),
        ("half-sound.mp4", find(b"udta", 0) - 10),
    ] {
        assert_eq!(
            notes(&films.write(name, &bytes[..end])),
            whole_picture,
            "{name}"
        );
    }
    let front = films.run(&format!("{film} {H264} -movflags +faststart front.mp4"));
    let front = std::fs::read(front).expect("the film");
    assert_eq!(
        notes(&films.write("tail.mp4", &front[..front.len() - 40])),
        whole_picture
    );
    for (name, cut) in [
        ("half-index.mp4", &bytes[..find(b"trak", 1) - 100]),
        ("half.mp4", &front[..front.len() / 2]),
    ] {
        let path = films.write(name, cut);
        let refusal = Video::open(&path, &Limits::default()).expect_err(name);
        assert_eq!(refusal.code(), Code::Truncated, "{name}");
        let longest = refusal.to_string().split(' ').map(str::len).max();
        assert!(longest < Some(12), "{refusal}");
    }
    for name in ["index.avi", "index.mkv", "index.wmv"] {
        let codec = if name.ends_with("wmv") {
            "-c:v wmv2"
        } else {
            H264
        };
        let film = films.run(&format!("{film} {codec} {name}"));
        let bytes = std::fs::read(&film).expect("the film");
        let cut = films.write(&format!("cut.{name}"), &bytes[..bytes.len() - 10]);
        assert_eq!(notes(&cut), whole_picture, "{name}");
    }
}

#[test]
fn elementary_stream_has_the_rate_of_its_header_or_options() {
    let films = Films::new();
    for (codec, name) in [
        ("libx264", "a.h264"),
        ("libx265 -x265-params log-level=none", "a.hevc"),
    ] {
        let film = films.test_picture(
            "64x48",
            40,
            &format!("-c:v {codec} -pix_fmt yuv420p {name}"),
        );
        assert_eq!(read(&films, &film), (25.0, 40), "{name}");
        assert_eq!(open(&film).notices(), []);
    }
    let film = films.path("a.h264");
    let silent =
        "-pix_fmt yuv420p -c:v libx265 -x265-params log-level=none:vui-timing-info=0 b.hevc";
    let silent = films.test_picture("64x48", 40, silent);
    assert_eq!(read(&films, &silent), (30.0, 40));
    assert_eq!(open(&silent).notices(), [Notice::RateAssumed { fps: 30.0 }]);
    for film in [film, silent] {
        let options = ReadOptions {
            fps: Some(12.5),
            ..ReadOptions::default()
        };
        let video = Video::open_with(&film, &Limits::default(), &options).expect("a good film");
        let frames = read_all(&video).expect("frames");
        assert_eq!((video.format().fps, frames.len()), (12.5, 40));
        assert!((frames[39].0 - 39.0 / 12.5).abs() < 1e-9 && video.notices().is_empty());
    }
}

#[test]
fn options_override_rate_and_pixel_aspect() {
    let films = Films::new();
    let film = films.test_picture(
        "64x48",
        40,
        "-vf setpts=N*N*0.01/TB,setsar=1 -fps_mode vfr -c:v mpeg4 slowing.mkv",
    );
    let options = ReadOptions {
        fps: Some(2.0),
        pixel_aspect: Some(2.0),
        ..ReadOptions::default()
    };
    let video = Video::open_with(&film, &Limits::default(), &options).expect("a good film");
    let format = video.format();
    assert_eq!((format.width, format.height, format.fps), (128, 48, 2.0));
    assert_eq!(read_all(&video).expect("frames").len(), 40);
}
