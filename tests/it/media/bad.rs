//! Bad input: each file is refused with its error code in time, and no process remains.

use std::path::Path;
use std::time::{Duration, Instant};

use flockreel::media::Limits;
use flockreel_core::code::Code;

use super::{n_processes_with, read_whole};
use crate::common::film::Films;

/// Returns the code with which a file is refused under the default limits.
fn refusal(path: &Path) -> Code {
    refusal_within(path, &Limits::default())
}

fn refusal_within(path: &Path, limits: &Limits) -> Code {
    let start = Instant::now();
    let code = read_whole(path, limits).map(|frames| frames.len());
    assert!(
        start.elapsed() < Duration::from_secs(30),
        "{path:?} took too long"
    );
    code.expect_err(&format!("{path:?} must be refused"))
}

#[test]
fn other_files_are_refused_by_their_first_bytes() {
    let films = Films::new();
    assert_eq!(refusal(&films.write("empty.mp4", "")), Code::NotAVideo);
    assert_eq!(
        refusal(&films.write("text.mp4", "Dear reader,\n")),
        Code::NotAVideo
    );
    assert_eq!(
        refusal(&films.write("noise.mp4", [0x9c; 5000])),
        Code::NotAVideo
    );
    for still in ["png", "jpg", "bmp"] {
        let image = films.test_picture("64x48", 1, &format!("still.{still}"));
        let renamed = films.write("image.mp4", std::fs::read(image).expect("an image"));
        assert_eq!(refusal(&renamed), Code::NotAVideo, "{still}");
    }
}

#[test]
fn playlist_with_the_name_of_a_film_is_refused() {
    let films = Films::new();
    films.test_picture("64x48", 25, "-c:v libx264 -pix_fmt yuv420p other.mp4");
    films.test_picture("64x48", 25, "-c:v libx264 -pix_fmt yuv420p other.ts");
    for text in PLAYLISTS {
        assert_eq!(
            refusal(&films.write("playlist.mp4", text)),
            Code::NotAVideo,
            "{text}"
        );
    }
}

/// Playlists that plain ffmpeg would follow to another file.
pub(super) const PLAYLISTS: [&str; 4] = [
    "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nother.ts\n#EXT-X-ENDLIST\n",
    "ffconcat version 1.0\nfile other.mp4\n",
    "<?xml version=\"1.0\"?><MPD type=\"static\" mediaPresentationDuration=\"PT1S\"><Period>\
     <AdaptationSet mimeType=\"video/mp4\"><Representation id=\"1\"><BaseURL>other.mp4</BaseURL>\
     </Representation></AdaptationSet></Period></MPD>",
    "[playlist]\nFile1=other.mp4\nNumberOfEntries=1\n",
];

#[test]
fn file_with_only_sound_has_no_video_stream() {
    let films = Films::new();
    let tone = "-f lavfi -i sine=duration=1";
    for name in ["tone.wav", "tone.m4a", "tone.mka", "tone.flac", "tone.mp3"] {
        let sound = films.run(&format!("{tone} {name}"));
        assert_eq!(refusal(&sound), Code::NoVideoStream, "{name}");
    }
}

#[test]
fn other_containers_and_codecs_are_refused_by_name() {
    let films = Films::new();
    for (codec, name) in [
        ("libvpx -f ivf", "film.ivf"),
        ("mpeg2video", "bare.m2v"),
        ("mpeg2video", "film.mxf"),
    ] {
        let film = films.test_picture("64x48", 10, &format!("-c:v {codec} {name}"));
        assert_eq!(refusal(&film), Code::ContainerNotAllowed, "{name}");
    }
    for (codec, name) in [
        ("magicyuv -pix_fmt yuv420p", "magic.avi"),
        ("utvideo -pix_fmt yuv420p", "ut.avi"),
        ("qtrle", "animation.mov"),
        ("cinepak", "cinepak.avi"),
    ] {
        let film = films.test_picture("64x48", 10, &format!("-c:v {codec} {name}"));
        assert_eq!(refusal(&film), Code::CodecNotAllowed, "{name}");
    }
}

#[test]
fn cut_off_film_is_truncated_in_every_container() {
    let films = Films::new();
    for (args, name) in [
        ("-c:v libx264 -movflags +faststart", "front.mp4"),
        ("-c:v libx264", "back.mp4"),
        ("-c:v libx264", "film.mkv"),
        (
            "-c:v libvpx-vp9 -deadline realtime -cpu-used 8",
            "film.webm",
        ),
        ("-c:v mjpeg -pix_fmt yuvj420p", "film.avi"),
        ("-c:v mpeg4", "divx.avi"),
        ("-c:v wmv2", "film.asf"),
        ("-c:v flv", "film.flv"),
        ("-c:v libtheora", "film.ogv"),
        (
            "-c:v libx264 -movflags +frag_keyframe+empty_moov -g 30",
            "parts.mp4",
        ),
    ] {
        let film = films.test_picture("160x120", 100, &format!("-pix_fmt yuv420p {args} {name}"));
        let whole = read_whole(&film, &Limits::default()).map(|frames| frames.len());
        assert_eq!(whole, Ok(100), "{name}");
        for share in [0.9, 0.6, 0.3] {
            let cut = films.cut(&film, share, &format!("cut.{name}"));
            assert_eq!(refusal(&cut), Code::Truncated, "{name} cut at {share}");
        }
    }
}

#[test]
fn cut_film_can_be_read_up_to_the_cut() {
    let films = Films::new();
    let film = films.test_picture("160x120", 100, "-c:v libx264 -pix_fmt yuv420p film.mkv");
    let cut = films.cut(&film, 0.6, "cut.mkv");
    let limits = Limits {
        allow_truncated: true,
        ..Limits::default()
    };
    let n_frames = read_whole(&cut, &limits).expect("allowed").len();
    assert!((20..100).contains(&n_frames), "{n_frames}");
}

#[test]
fn film_with_damaged_bytes_decodes_or_is_refused() {
    let films = Films::new();
    for name in ["film.mp4", "film.mkv", "film.ts"] {
        let film = films.test_picture(
            "160x120",
            60,
            &format!("-c:v libx264 -pix_fmt yuv420p {name}"),
        );
        let mut bytes = std::fs::read(film).expect("the film");
        let middle = bytes.len() / 2;
        for (k, byte) in bytes[middle - 3000..middle + 3000].iter_mut().enumerate() {
            *byte = (k * 193 % 251) as u8;
        }
        let broken = films.write(name, bytes);
        match read_whole(&broken, &Limits::default()) {
            Ok(frames) => assert!(frames.len() >= 50, "{name}: {}", frames.len()),
            Err(code) => assert!(
                [Code::Truncated, Code::NotAVideo].contains(&code),
                "{name}: {code}"
            ),
        }
    }
}

#[test]
fn each_limit_has_its_code() {
    let films = Films::new();
    let film = films.test_picture("64x48", 50, "-c:v libx264 -pix_fmt yuv420p film.mp4");
    type Lower = fn(&mut Limits);
    let cases: [(Lower, Code); 10] = [
        (|limits| limits.max_frames = 49, Code::TooManyFrames),
        (|limits| limits.min_frames = 51, Code::TooFewFrames),
        (
            |limits| limits.max_pixels = 64 * 48 - 1,
            Code::TooManyPixels,
        ),
        (|limits| limits.max_side_px = 63, Code::TooManyPixels),
        (|limits| limits.min_side_px = 49, Code::TooFewPixels),
        (|limits| limits.max_fps = 24.0, Code::TooFast),
        (|limits| limits.max_duration_s = 1.9, Code::TooLong),
        (|limits| limits.max_bytes = 1000, Code::TooLong),
        (|limits| limits.stall_time = Duration::ZERO, Code::TimeLimit),
        (|limits| limits.probe_time = Duration::ZERO, Code::TimeLimit),
    ];
    for (lower, code) in cases {
        let mut limits = Limits::default();
        lower(&mut limits);
        assert_eq!(refusal_within(&film, &limits), code, "{limits:?}");
    }
    assert_eq!(
        read_whole(&film, &Limits::default()).map(|frames| frames.len()),
        Ok(50)
    );
    assert_eq!(n_processes_with(&films.folder().display().to_string()), 0);
}

#[test]
fn decoder_without_memory_fails_with_memory_limit() {
    let films = Films::new();
    let film = films.test_picture("64x48", 50, "-c:v libx264 -pix_fmt yuv420p film.mp4");
    let limits = Limits {
        max_memory_bytes: 220 << 20,
        ..Limits::default()
    };
    let code = refusal_within(&film, &limits);
    assert_eq!(code, Code::MemoryLimit);
}

#[test]
fn too_small_pictures_and_films_of_one_frame_are_refused() {
    let films = Films::new();
    let tiny = films.test_picture("8x8", 10, "-c:v libx264 -pix_fmt yuv420p tiny.mp4");
    assert_eq!(refusal(&tiny), Code::TooFewPixels);
    let single = films.test_picture("64x48", 1, "-c:v libx264 -pix_fmt yuv420p single.mp4");
    assert_eq!(refusal(&single), Code::TooFewFrames);
}

#[test]
fn too_many_streams_are_refused_before_decoding() {
    let films = Films::new();
    let maps = "-map 0:v ".repeat(40);
    let film = films.test_picture("64x48", 5, &format!("{maps} -c:v mpeg4 many.mkv"));
    assert_eq!(refusal(&film), Code::TooManyStreams);
}

#[test]
fn encrypted_film_is_refused_as_encrypted() {
    let films = Films::new();
    let key = "00112233445566778899aabbccddeeff";
    let film = films.test_picture(
        "64x48",
        10,
        &format!(
            "-c:v libx264 -pix_fmt yuv420p -encryption_scheme cenc-aes-ctr -encryption_key {key} \
         -encryption_kid {key} locked.mp4"
        ),
    );
    assert_eq!(refusal(&film), Code::Encrypted);
}

#[test]
fn dropped_reader_leaves_no_decoder() {
    let films = Films::new();
    let film = films.test_picture("320x240", 500, "-c:v libx264 -pix_fmt yuv420p long.mp4");
    let name = film.display().to_string();
    let video = flockreel::media::Video::open(&film, &Limits::default()).expect("a good film");
    let mut stream = flockreel_core::footage::FrameSource::open(&video).expect("a decoder");
    let mut frame = flockreel_core::raster::Frame::default();
    stream.next_frame(&mut frame).expect("a first frame");
    assert_eq!(n_processes_with(&name), 1);
    drop(stream);
    assert_eq!(n_processes_with(&name), 0);
}
