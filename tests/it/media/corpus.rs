//! More than a hundred bad and unusual films, generated at run time, with their allowed error codes
//! (docs/explanation/promises.md, "Bad input"). A film damaged at a random place may also be readable.

use std::path::PathBuf;

use flockreel_core::code::Code;

use super::bad::PLAYLISTS;
use crate::common::film::Films;

/// A file and its allowed outcomes.
pub(crate) struct Case {
    pub(crate) path: PathBuf,
    /// The error codes with which the file may be refused.
    pub(crate) codes: Vec<Code>,
    /// True if all its frames may be read.
    pub(crate) may_be_good: bool,
}

/// Allowed error codes of damaged files.
const DAMAGED: [Code; 5] = [
    Code::Truncated,
    Code::NotAVideo,
    Code::NoVideoStream,
    Code::CodecNotAllowed,
    Code::DecoderCrashed,
];

/// The corpus under construction.
struct Corpus<'a> {
    films: &'a Films,
    cases: Vec<Case>,
}

/// Generates all files.
pub(crate) fn corpus(films: &Films) -> Vec<Case> {
    let cases = Vec::new();
    let mut corpus = Corpus { films, cases };
    corpus.cut_and_flipped();
    corpus.add_other_kinds();
    corpus.add_texts_and_junk();
    corpus.add_odd_films();
    corpus.add_odd_but_good_films();
    corpus.add_leaping_times();
    corpus.add_lying_headers();
    corpus.cases
}

impl Corpus<'_> {
    fn refused(&mut self, path: PathBuf, codes: &[Code]) {
        let codes = codes.to_vec();
        self.cases.push(Case {
            path,
            codes,
            may_be_good: false,
        });
    }

    fn good(&mut self, path: PathBuf) {
        self.damaged(path, &[]);
    }

    /// Adds a file that may be readable, or refused with one of the codes.
    fn damaged(&mut self, path: PathBuf, codes: &[Code]) {
        self.refused(path, codes);
        self.cases.last_mut().unwrap().may_be_good = true;
    }

    fn film(&self, n_frames: usize, args: &str) -> PathBuf {
        self.films.test_picture("64x48", n_frames, args)
    }

    fn cut_and_flipped(&mut self) {
        let h264 = "-c:v libx264 -g 10 -pix_fmt yuv420p";
        let h265 = "-c:v libx265 -x265-params log-level=none";
        for (args, name, n_cuts, n_flips) in [
            (&*format!("{h264} -movflags +faststart"), "front.mp4", 7, 5),
            (h264, "back.mp4", 3, 1),
            (h264, "film.mkv", 4, 4),
            ("-c:v mjpeg -pix_fmt yuvj420p", "film.avi", 3, 2),
            ("-c:v wmv2", "film.asf", 2, 1),
            (h264, "film.ts", 2, 2),
            ("-c:v flv", "film.flv", 3, 2),
            ("-c:v libtheora", "film.ogv", 3, 2),
            ("-c:v ffvhuff", "huff.avi", 2, 2),
            ("-c:v png", "pictures.avi", 2, 2),
            ("-c:v mpeg1video", "film.mpg", 2, 2),
            ("-c:v mpeg2video", "film.vob", 1, 1),
            (h264, "film.h264", 2, 2),
            (h265, "film.hevc", 2, 2),
        ] {
            let film = self.film(40, &format!("{args} {name}"));
            let bytes = std::fs::read(&film).unwrap();
            self.good(film);
            for k in 1..=n_cuts {
                let cut = &bytes[..bytes.len() * k / (n_cuts + 1)];
                let path = self.films.write(&format!("cut{k}.{name}"), cut);
                // Packet streams have no index or end marker, so a cut may go unnoticed.
                let endless = ["ts", "mpg", "vob", "h264", "hevc"];
                if endless.iter().any(|ending| name.ends_with(ending)) {
                    self.damaged(path, &[&DAMAGED[..], &LIES[..]].concat())
                } else {
                    self.refused(path, &DAMAGED)
                }
            }
            for k in 0..n_flips {
                let mut flipped = bytes.clone();
                for j in 0..20 {
                    let at = (k * 7919 + j * 104_729 + 40) % (bytes.len() - 40) + 40;
                    flipped[at] ^= 1 << (j % 8);
                }
                let path = self.films.write(&format!("flip{k}.{name}"), flipped);
                self.damaged(path, &[&DAMAGED[..], &LIES[..]].concat());
            }
            let mut holed = bytes;
            let (from, to) = (holed.len() / 2, holed.len() / 2 + holed.len() / 8);
            holed[from..to].fill(0);
            let path = self.films.write(&format!("hole.{name}"), holed);
            self.damaged(path, &DAMAGED);
        }
    }

    fn add_other_kinds(&mut self) {
        for (args, name, code) in [
            ("-c:v mpeg2video", "bare.m2v", Code::ContainerNotAllowed),
            ("-c:v mpeg4 -f m4v", "bare.mpeg4", Code::ContainerNotAllowed),
            ("-c:v mpeg2video", "film.mxf", Code::ContainerNotAllowed),
            ("-c:v libvpx -f ivf", "film.ivf", Code::ContainerNotAllowed),
            ("-pix_fmt yuv420p", "film.y4m", Code::ContainerNotAllowed),
            (
                "-c:v magicyuv -pix_fmt yuv420p",
                "magic.avi",
                Code::CodecNotAllowed,
            ),
            ("-c:v qtrle", "rle.mov", Code::CodecNotAllowed),
            ("-c:v cinepak", "cinepak.avi", Code::CodecNotAllowed),
            ("-c:v svq1", "sorenson.mov", Code::CodecNotAllowed),
            (
                "-c:v dvvideo -s 720x576 -pix_fmt yuv420p",
                "dv.avi",
                Code::CodecNotAllowed,
            ),
            ("-c:v utvideo", "ut.avi", Code::CodecNotAllowed),
            ("-update 1", "still.tiff", Code::TooFewFrames),
        ] {
            let film = self.film(10, &format!("{args} {name}"));
            self.refused(film, &[code]);
        }
        let still = self.film(1, "still.gif");
        self.refused(still, &[Code::TooFewFrames]);
        for name in ["still.png", "still.jpg", "still.bmp", "still.webp"] {
            let film = self.film(1, name);
            self.refused(film, &[Code::NotAVideo]);
        }
        for name in ["tone.wav", "tone.m4a", "tone.mka", "tone.flac", "tone.mp3"] {
            let sound = self
                .films
                .run(&format!("-f lavfi -i sine=duration=1 {name}"));
            self.refused(sound, &[Code::NoVideoStream]);
        }
        self.films
            .write("words.srt", "1\n00:00:01,000 --> 00:00:02,000\nHello.\n");
        let titles = self.films.run("-i words.srt -c:s srt titles.mkv");
        self.refused(titles, &[Code::NoVideoStream]);
        let cover = self.films.run(
            "-i tone.m4a -i still.jpg -map 0 -map 1 -c:a copy -c:v copy -disposition:v:0 attached_pic \
             cover.m4a",
        );
        self.refused(cover, &[Code::NoVideoStream]);
    }

    fn add_texts_and_junk(&mut self) {
        let texts = [
            "",
            "x",
            "Dear reader,\n",
            "<html><script>alert(1)</script></html>",
            "concat:front.mp4|back.mp4",
            "subfile,,start,0,end,0,,:front.mp4",
            "#!/bin/sh\nexit\n",
            "%PDF-1.7\n",
        ];
        for (k, text) in texts.iter().chain(&PLAYLISTS).enumerate() {
            let path = self.films.write(&format!("text{k}.mp4"), text);
            self.refused(path, &[Code::NotAVideo]);
        }
        let heads: [&[u8]; 3] = [
            b"\0\0\0\x10ftypisom\0\0\0\0\n",
            b"\x1a\x45\xdf\xa3\n",
            b"RIFF\x10\0\0\0AVI \n",
        ];
        for (k, text) in PLAYLISTS.iter().enumerate() {
            let dressed = [heads[k % 3], text.as_bytes()].concat();
            let path = self.films.write(&format!("dressed{k}.mp4"), dressed);
            self.refused(path, &DAMAGED);
        }
        let noise = (0..20_000u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8);
        let archive = [b"PK\x03\x04\x14\0\0\0\x08\0".as_slice(), &[0; 4000]].concat();
        for (name, bytes) in [
            ("zeros", vec![0; 20_000]),
            ("ones", vec![0xff; 20_000]),
            ("syncs", vec![0x47; 20_000]),
            ("noise", noise.collect()),
            ("zip", archive),
            ("gzip", [b"\x1f\x8b\x08\0".as_slice(), &[0; 4000]].concat()),
        ] {
            let path = self.films.write(&format!("{name}.mp4"), bytes);
            self.refused(
                path,
                &[Code::NotAVideo, Code::NoVideoStream, Code::Truncated],
            );
        }
    }

    fn add_odd_films(&mut self) {
        let h264 = "-c:v libx264 -pix_fmt yuv420p";
        let key = "00112233445566778899aabbccddeeff";
        let locked = format!(
            "{h264} -encryption_scheme cenc-aes-ctr -encryption_key {key} -encryption_kid {key} locked.mp4"
        );
        let many = format!("{} -c:v mpeg4 many.mkv", "-map 0:v ".repeat(33));
        for (n_frames, args, codes) in [
            (10, locked.as_str(), &[Code::Encrypted][..]),
            (3, &many, &[Code::TooManyStreams]),
            (1, "-c:v mpeg4 single.mp4", &[Code::TooFewFrames]),
            (
                30,
                "-vf settb=1/1001,setpts=N -r 1001 -c:v mpeg4 fast.mp4",
                &[Code::TooFast],
            ),
            (
                3,
                "-vf setpts=N*1800/TB -fps_mode vfr -c:v mpeg4 long.mkv",
                &[Code::TooLong],
            ),
            (10, "-vf scale=1:1 -c:v ffv1 dot.mkv", &[Code::TooFewPixels]),
            (
                10,
                "-vf scale=640:2,setsar=1 -c:v ffv1 line.mkv",
                &[Code::TooFewPixels],
            ),
            (
                3,
                "-vf scale=8208:64,setsar=1 -c:v ffv1 wide.mkv",
                &[Code::TooManyPixels],
            ),
            (
                3,
                "-vf scale=4096:2176,setsar=1 -c:v mjpeg -q:v 30 large.avi",
                &[Code::TooManyPixels],
            ),
            (
                10,
                "-vf setsar=sar=1000/1:max=1000 -c:v mpeg4 stretched.mkv",
                &[Code::TooManyPixels],
            ),
            (
                10,
                "-vf setsar=1/250 -c:v mpeg4 tall.mkv",
                &[Code::TooManyPixels],
            ),
        ] {
            let film = self.film(n_frames, args);
            self.refused(film, codes);
        }
    }

    fn add_odd_but_good_films(&mut self) {
        for args in [
            "-vf setsar=2/1 -c:v mpeg4 double.mkv",
            "-vf scale=8192:16,setsar=1 -c:v ffv1 widest.mkv",
            "-c:v mpeg4 -metadata:s:v:0 rotate=90 turned.mp4",
            "-vf setpts=N*N*0.01/TB -fps_mode vfr -c:v mpeg4 slowing.mkv",
            "-vf select='not(mod(floor(n/3),2))' -fps_mode vfr -c:v mpeg4 stutter.mkv",
            "-c:v huffyuv -pix_fmt yuv422p huff.mkv",
            "-c:v png pictures.mov",
            "-c:v libtheora theora.mkv",
            "-c:v mpeg1video one.mkv",
        ] {
            let film = self.film(20, args);
            self.good(film);
        }
        // A file with a header and no frames.
        let none = self
            .films
            .run("-f lavfi -i nullsrc=size=64x48:rate=25:duration=0 -c:v mpeg4 none.mkv");
        self.refused(
            none,
            &[
                Code::TooFewFrames,
                Code::Truncated,
                Code::NotAVideo,
                Code::NoVideoStream,
            ],
        );
    }

    /// Adds small files whose time stamps imply billions of frames, or extremely high frame rates.
    fn add_leaping_times(&mut self) {
        self.film(40, "-c:v libx264 -bf 0 -pix_fmt yuv420p even.mp4");
        let micro = "time_base=1/1000000 -video_track_timescale 1000000";
        for (args, code) in [
            ("setts=ts=TS+gte(N\\,20)*100000000/TB leap.mkv", None),
            (
                &*format!("setts=ts=N:{micro} tiny.mp4"),
                Some(Code::TooFast),
            ),
            (
                &*format!("setts=ts=N+gte(N\\,20)*2000000000:{micro} tiny-leap.mp4"),
                Some(Code::TooFast),
            ),
            (
                "setts=ts=N*2+gte(N\\,20)*3000000:time_base=1/1000 leap-of-frames.mkv",
                None,
            ),
            (
                "setts=ts=N*1800000:time_base=1/1000 hours.mkv",
                Some(Code::TooLong),
            ),
        ] {
            let film = self
                .films
                .run(&format!("-i even.mp4 -c copy -bsf:v {args}"));
            match code {
                Some(code) => self.refused(film, &[code]),
                None => self.good(film),
            }
        }
    }

    fn add_lying_headers(&mut self) {
        let film = std::fs::read(self.films.path("front.mp4")).unwrap();
        let at = |name: &[u8]| film.windows(4).position(|w| w == name).unwrap();
        let patched = |at: usize, bytes: &[u8]| {
            let mut lie = film.clone();
            lie[at..at + bytes.len()].copy_from_slice(bytes);
            lie
        };
        // Offsets of the fields, relative to the name of their box.
        let lies = [
            (
                "moov-size",
                patched(at(b"moov") - 4, &[0x7f, 0xff, 0xff, 0xff]),
            ),
            (
                "mdat-size",
                patched(at(b"mdat") - 4, &[0x7f, 0xff, 0xff, 0xff]),
            ),
            (
                "samples",
                patched(at(b"stsz") + 12, &[0x7f, 0xff, 0xff, 0xff]),
            ),
            ("no-samples", patched(at(b"stsz") + 12, &[0; 4])),
            ("times", patched(at(b"stts") + 8, &[0x0f, 0xff, 0xff, 0xff])),
            ("slow", patched(at(b"stts") + 16, &[0x7f, 0xff, 0xff, 0xff])),
            (
                "sides",
                patched(at(b"avc1") + 28, &[0xff, 0xff, 0xff, 0xff]),
            ),
            ("scale", patched(at(b"mdhd") + 16, &[0, 0, 0, 1])),
            (
                "chunks",
                patched(at(b"stco") + 12, &[0xff, 0xff, 0xff, 0xf0]),
            ),
        ];
        for (name, bytes) in lies {
            let path = self.films.write(&format!("{name}.mp4"), bytes);
            self.damaged(path, &[&DAMAGED[..], &LIES[..]].concat());
        }
        let boxed = |name: &[u8], inside: &[u8]| {
            [&((inside.len() + 8) as u32).to_be_bytes(), name, inside].concat()
        };
        // A compressed header that claims to expand to 2 GiB.
        let unfolds = [&[0x7f, 0xff, 0xff, 0xff], &[0x78, 0x9c][..], &[0; 64]].concat();
        let bomb = [boxed(b"dcom", b"zlib"), boxed(b"cmvd", &unfolds)].concat();
        let bomb = boxed(b"moov", &boxed(b"cmov", &bomb));
        let endless = [b"\0\0\0\x01mdat".as_slice(), &[0xff; 8], &[0; 400]].concat();
        let ebml = b"\x1a\x45\xdf\xa3\x01\xff\xff\xff\xff\xff\xff\xfe\x42\x82".to_vec();
        let path = self.films.write("bomb.mp4", bomb);
        self.refused(path, &[Code::MemoryLimit]);
        for (name, bytes) in [("endless", endless), ("ebml", ebml)] {
            let path = self.films.write(&format!("{name}.mp4"), bytes);
            self.refused(path, &DAMAGED);
        }
    }
}

/// Allowed error codes of files with false headers, besides `DAMAGED`.
const LIES: [Code; 8] = [
    Code::TooManyPixels,
    Code::TooFewPixels,
    Code::TooManyFrames,
    Code::TooFewFrames,
    Code::TooLong,
    Code::TooFast,
    Code::MemoryLimit,
    Code::Encrypted,
];
