//! Damaged indexes of MP4 files. ffmpeg reads such a file without an error, or reads a part of it.

use std::path::Path;

use flockreel::media::{Limits, Notice, Video};
use flockreel_core::code::Code;

use super::{open, read_all};
use crate::common::film::Films;

const PICTURES_AND_SOUND: &str = "-f lavfi -i testsrc2=size=64x48:rate=25:d=2 -f lavfi -i sine=d=2 -map 0 -map 1 \
                                  -c:v libx264 -pix_fmt yuv420p -bf 2 -c:a aac";

/// The bytes of an MP4 file with pictures in its first track and sound in its second.
struct Film(Vec<u8>);

impl Film {
    fn new(films: &Films, args: &str) -> Film {
        let film = films.run(&format!("{PICTURES_AND_SOUND} {args}"));
        Film(std::fs::read(film).expect("the film"))
    }

    /// Returns the position of a box of a track.
    fn find(&self, track: usize, name: &[u8; 4]) -> usize {
        let places = |name: [u8; 4]| {
            let windows = self.0.windows(4).enumerate();
            windows
                .filter(move |(_, bytes)| *bytes == name)
                .map(|(at, _)| at - 4)
        };
        let start = places(*b"trak").nth(track).expect("a track");
        places(*name).find(|at| *at >= start).expect("such a box")
    }

    fn with_number(&self, at: usize, number: u32) -> Vec<u8> {
        let mut bytes = self.0.clone();
        bytes[at..at + 4].copy_from_slice(&number.to_be_bytes());
        bytes
    }

    /// Returns the film up to `end`, in its index. The index is as long as it says.
    fn cut_index(&self, end: usize) -> Vec<u8> {
        let windows = self.0.windows(4);
        let start = windows
            .rev()
            .position(|bytes| bytes == b"moov")
            .expect("an index");
        let start = self.0.len() - 4 - start - 4;
        let n_bytes = u32::try_from(end - start).expect("a short index");
        self.with_number(start, n_bytes)[..end].to_vec()
    }
}

/// Asserts that all pictures are read, with a notice about the index.
fn assert_noticed(path: &Path) {
    let video = open(path);
    assert_eq!(read_all(&video).expect("frames").len(), 50, "{path:?}");
    let expected = [Notice::IndexDamaged { n_pictures: 50 }];
    assert_eq!(video.notices(), expected, "{path:?}");
}

fn assert_refused(path: &Path) {
    let refusal = Video::open(path, &Limits::default()).expect_err("a damaged film");
    assert_eq!(refusal.code(), Code::Truncated, "{path:?}: {refusal}");
}

#[test]
fn damaged_index_of_the_sound_gives_a_notice() {
    let films = Films::new();
    for args in ["back.mp4", "-movflags +faststart front.mp4", "film.mov"] {
        let film = Film::new(&films, args);
        let name = args.split(' ').next_back().expect("a name");
        let path = films.path(name);
        assert_eq!(open(&path).notices(), [], "{name}");
        let chunk = film.find(1, b"stco") + 16;
        let table = film.find(1, b"stbl");
        for (damage, bytes) in [
            ("chunk", film.with_number(chunk, 0x7fff_ffff)),
            ("table", film.with_number(table, 0x00ff_ffff)),
        ] {
            assert_noticed(&films.write(&format!("{damage}.{name}"), bytes));
        }
    }
    let film = Film::new(&films, "cut.mp4");
    let cut = film.cut_index(film.find(1, b"minf") + 30);
    assert_noticed(&films.write("cut.mp4", cut));
}

#[test]
fn damaged_index_of_the_pictures_is_refused_as_truncated() {
    let films = Films::new();
    let film = Film::new(&films, "-movflags +faststart front.mp4");
    for (name, offset) in [
        (b"stts", 12),
        (b"stsc", 12),
        (b"stsz", 16),
        (b"stco", 12),
        (b"ctts", 12),
    ] {
        let at = film.find(0, name) + offset;
        let path = films.write("count.mp4", film.with_number(at, 10_000));
        assert_refused(&path);
    }
    let last = film.find(0, b"stco") + 16 + 4 * 40;
    assert_refused(&films.write("chunk.mp4", film.with_number(last, 0x7fff_ffff)));
    let film = Film::new(&films, "back.mp4");
    for name in [b"minf", b"stts", b"stsc", b"stsz", b"stco"] {
        let cut = film.cut_index(film.find(0, name) + 30);
        assert_refused(&films.write("cut.mp4", cut));
    }
}

#[test]
fn unusual_but_whole_indexes_give_no_notice() {
    let films = Films::new();
    for args in [
        "-movflags frag_keyframe+empty_moov fragments.mp4",
        "-movflags frag_keyframe fragments-and-index.mp4",
        "-timecode 00:00:00:00 timecode.mov",
        "-c:a pcm_s16le pcm.mov",
        "-movflags +faststart -metadata title=x titled.m4v",
        "-f 3gp film.3gp",
    ] {
        let film = films.run(&format!("{PICTURES_AND_SOUND} {args}"));
        let video = open(&film);
        assert_eq!(video.notices(), [], "{args}");
        assert_eq!(read_all(&video).expect("frames").len(), 50, "{args}");
    }
}
