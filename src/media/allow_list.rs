//! Allow-lists for ffmpeg: protocols, demuxers, decoders and sizes (docs/explanation/promises.md, "Confined
//! media tools"). A file that refers to other files, or needs a decoder outside the list, fails.

use std::ffi::OsString;
use std::path::Path;

use super::container::Container;
use super::limits::Limits;

/// Allowed demuxers. `Container` selects one of them; ffmpeg enforces this list as well.
const FORMATS: &str = "mov,matroska,avi,mpegts,asf,mpeg,flv,ogg,gif,apng,h264,hevc";

/// Allowed video decoders, by ffmpeg's names.
const DECODERS: &str = "h264,hevc,vp8,vp9,libvpx,libvpx-vp9,av1,libdav1d,libaom-av1,mpeg4,mpeg2video,mjpeg,prores,\
                        ffv1,rawvideo,wmv2,wmv3,vc1,mpeg1video,huffyuv,ffvhuff,png,theora,flv,h263,gif,apng";

/// Allowed decoders of audio and subtitles. None of these streams is used, but ffprobe fails on a file if it
/// may not open one of its streams.
const OTHER_DECODERS: &str = "aac,mp3float,mp3,mp2float,mp2,ac3,eac3,dca,truehd,opus,libopus,vorbis,\
    flac,alac,amrnb,amrwb,wmav1,wmav2,wmapro,adpcm_ms,adpcm_ima_wav,adpcm_swf,nellymoser,speex,pcm_u8,pcm_s8,pcm_s16le,pcm_s16be,\
    pcm_s24le,pcm_s24be,pcm_s32le,pcm_s32be,pcm_f32le,pcm_f32be,pcm_alaw,pcm_mulaw,pcm_dvd,pcm_bluray,\
    mov_text,subrip,srt,ass,ssa,webvtt,dvbsub,dvdsub,pgssub";

/// Frame rate with which an elementary stream is opened, frames per second. A stream with its own rate
/// overrides it. No camera has this rate, so it marks an unknown rate.
pub(super) const UNKNOWN_RATE_FPS: f64 = 997.0 / 7.0;

/// Returns the arguments that restrict ffmpeg to the given file, followed by the file as input.
pub(super) fn input_args(container: Container, path: &Path, limits: &Limits) -> Vec<OsString> {
    let mut file = OsString::from("file:");
    file.push(path);
    // Decoders round sizes up to whole blocks. `probe` checks the exact picture size.
    let max_pixels = limits.max_pixels + u64::from(limits.max_side_px) * 128;
    let mut args: Vec<OsString> = [
        ("-protocol_whitelist", "file".to_owned()),
        ("-format_whitelist", FORMATS.to_owned()),
        ("-codec_whitelist", format!("{DECODERS},{OTHER_DECODERS}")),
        // Upper limit of a single allocation.
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
    if container.is_elementary_stream() {
        args.extend(["-framerate", "997/7"].map(Into::into));
    }
    args.extend(["-i".into(), file]);
    args
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::net::TcpListener;
    use std::time::Duration;

    use super::*;
    use crate::media::gate::Child;
    use crate::media::invocation::Invocation;
    use crate::media::sandbox::Layers;
    use crate::media::tools::{Tool, installed};

    /// The limits for these tests. Only the allow-lists are tested, so the kernel layers of the sandbox are
    /// off.
    fn limits() -> Limits {
        Limits {
            layers: Layers::BASIC,
            // Starting a program takes longer on a busy machine.
            probe_time: Duration::from_secs(60),
            ..Limits::default()
        }
    }

    fn ffmpeg(args: Vec<OsString>, limits: &Limits) -> Invocation<'static> {
        Invocation::new(installed(Tool::Ffmpeg).unwrap(), args, limits, 0)
    }

    /// Returns the error message of ffmpeg for the arguments; `None` on success.
    fn error_message(args: Vec<OsString>) -> Option<String> {
        let limits = limits();
        let mut child = Child::reading(ffmpeg(args, &limits)).unwrap();
        child.read_full(&mut vec![0; 1 << 20]).unwrap();
        child.finish().unwrap().check().err().map(|e| e.to_string())
    }

    /// Decodes a film and discards the frames, without our container detection and with one list changed.
    fn decode(path: &Path, list: &str, value: Option<&str>) -> Option<String> {
        let mut args = input_args(Container::Mov, path, &limits());
        for (name, value) in [("-f", None), (list, value)] {
            let at = args.iter().position(|arg| arg == name);
            match (at, value) {
                (Some(at), Some(value)) => args[at + 1] = value.into(),
                (Some(at), None) => drop(args.drain(at..at + 2)),
                (None, _) => {}
            }
        }
        args.extend(["-f", "null", "-"].map(Into::into));
        error_message(args)
    }

    fn make(folder: &Path, name: &str, options: &str) -> std::path::PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, b"").unwrap();
        let mut args: Vec<OsString> = ["-y", "-f", "lavfi", "-i", "testsrc2=size=64x64:rate=25"]
            .map(Into::into)
            .to_vec();
        args.extend(["-frames:v", "5"].map(Into::into));
        args.extend(options.split(' ').map(Into::into));
        args.push(path.clone().into());
        let invocation = ffmpeg(args, &limits()).with_output(&path, 1 << 20);
        let exit = Child::reading(invocation).unwrap().finish().unwrap();
        assert!(exit.check().is_ok());
        path
    }

    fn playlist(folder: &Path, name: &str, of: &str) -> std::path::PathBuf {
        let path = folder.join(name);
        let text = format!("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{of}\n#EXT-X-ENDLIST\n");
        std::fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn each_list_alone_refuses_a_reference_to_another_file_or_decoder() {
        let folder = tempfile::tempdir().unwrap();
        make(folder.path(), "another.ts", "-c:v mpeg2video -f mpegts");
        let list = playlist(folder.path(), "film.mp4", "another.ts");
        let formats = "-format_whitelist";
        assert_eq!(
            decode(&list, formats, Some("hls,mpegts")),
            None,
            "so it would leak"
        );
        let held = decode(&list, "-nothing", None).expect("a playlist was followed");
        assert!(held.contains("not on whitelist"), "{held}");

        let film = make(folder.path(), "magic.avi", "-c:v magicyuv -pix_fmt yuv420p");
        assert_eq!(decode(&film, "-codec_whitelist", None), None);
        let held = decode(&film, "-nothing", None).expect("another decoder ran");
        assert!(held.contains("not on whitelist"), "{held}");
    }

    #[test]
    fn protocol_list_refuses_network_addresses_for_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let server = TcpListener::bind("127.0.0.1:0").unwrap();
        server.set_nonblocking(true).unwrap();
        let at = server.local_addr().unwrap();
        let list = playlist(folder.path(), "film.mp4", &format!("http://{at}/x.ts"));
        let held = decode(&list, "-format_whitelist", None).expect("an address was asked");
        let asked = server.accept().map_err(|error| error.kind());
        assert_eq!(asked.err(), Some(ErrorKind::WouldBlock), "{held}");
    }
}
