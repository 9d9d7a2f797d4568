//! What ffmpeg may open and run (RELIABILITY.md, "The gate"): protocols, demuxers, decoders, and
//! how much of each. A file that names other files, or needs a decoder outside the list, fails.

use std::ffi::OsString;
use std::path::Path;

use super::container::Container;
use super::limits::Limits;

/// Demuxers that may run. `Container` chooses one of them; this list holds inside ffmpeg as well.
const FORMATS: &str = "mov,matroska,avi,mpegts,asf";

/// Decoders that may run, by ffmpeg's names.
const DECODERS: &str = "h264,hevc,vp8,vp9,av1,libdav1d,libaom-av1,mpeg4,mpeg2video,mjpeg,prores,\
                        ffv1,rawvideo,wmv2,wmv3,vc1";

/// Decoders of sound and titles. Nothing of theirs is ever decoded to the end, but ffprobe gives up
/// on a file when it may not open one of its streams.
const OTHER_DECODERS: &str = "aac,mp3float,mp3,mp2float,mp2,ac3,eac3,dca,truehd,opus,libopus,vorbis,\
    flac,alac,amrnb,amrwb,wmav1,wmav2,wmapro,adpcm_ms,adpcm_ima_wav,pcm_u8,pcm_s8,pcm_s16le,pcm_s16be,\
    pcm_s24le,pcm_s24be,pcm_s32le,pcm_s32be,pcm_f32le,pcm_f32be,pcm_alaw,pcm_mulaw,pcm_dvd,pcm_bluray,\
    mov_text,subrip,srt,ass,ssa,webvtt,dvbsub,pgssub";

/// The arguments that close the ways out of a file, then the file as the input.
pub(super) fn input_args(container: Container, path: &Path, limits: &Limits) -> Vec<OsString> {
    let mut file = OsString::from("file:");
    file.push(path);
    // Decoders round sizes up to whole blocks; the picture's own size is checked by `probe`.
    let max_pixels = limits.max_pixels + u64::from(limits.max_side_px) * 128;
    let mut args: Vec<OsString> = [
        ("-protocol_whitelist", "file".to_owned()),
        ("-format_whitelist", FORMATS.to_owned()),
        ("-codec_whitelist", format!("{DECODERS},{OTHER_DECODERS}")),
        // No single piece of memory is larger than this many times a picture.
        (
            "-max_alloc",
            (limits.max_pixels * 64).max(64 << 20).to_string(),
        ),
        ("-max_streams", limits.max_streams.to_string()),
        ("-max_pixels", max_pixels.to_string()),
        ("-probesize", "5000000".to_owned()),
        ("-analyzeduration", "5000000".to_owned()),
        ("-f", container.demuxer().to_owned()),
    ]
    .into_iter()
    .flat_map(|(name, value)| [name.into(), value.into()])
    .collect();
    args.extend(["-i".into(), file]);
    args
}
