//! Timestamps of the video packets of a file and, if those do not suffice, of the decoded pictures. The
//! choice of the stream, its length and its frame rate depend on them, not on the claims of the header
//! (docs/explanation/promises.md, "Bad input").

use std::path::Path;
use std::time::Duration;

use crate::media::allow_list::input_args;
use crate::media::container::Container;
use crate::media::error::Error;
use crate::media::gate::Child;
use crate::media::invocation::Invocation;
use crate::media::limits::Limits;
use crate::media::tools::{Tool, installed};

/// Minimum read speed of a disk, bytes per second. Reading packet times needs the whole file. Free choice.
const MIN_DISK_BYTES_PER_S: u64 = 50_000_000;

/// Maximum length of ffprobe's output for one packet with its side data, bytes. Free choice.
const MAX_LINE_BYTES: usize = 64 << 10;

/// Messages of ffprobe for a Matroska file whose structure breaks off.
const STRUCTURE_ERRORS: [&str; 2] = ["File ended prematurely", "EBML number"];

/// Packets of up to this size, bytes, may encode a repeated picture. Some decoders output no picture for
/// them.
const MAX_EMPTY_BYTES: u64 = 16;

/// Longest delay of a picture by reordering in any codec, seconds.
const MAX_REORDER_S: f64 = 1.0;

/// The packets of one stream.
#[derive(Clone, Debug)]
pub(super) struct Packets {
    /// Index of the stream in the file.
    pub(super) stream_idx: u64,
    /// Presentation times of the displayed packets, in file order.
    times_s: Vec<Option<f64>>,
    /// Whether the packets alone do not determine the pictures.
    is_ambiguous: bool,
    /// Whether a packet is encrypted.
    pub(super) encrypted: bool,
}

/// The packets of all video streams.
#[derive(Debug)]
pub(super) struct AllPackets {
    streams: Vec<Packets>,
    /// The end of ffprobe's stderr.
    stderr_tail: String,
}

impl AllPackets {
    /// Reads the packets of all video streams. Fails if a stream has more than `limits.max_frames`.
    pub(super) fn read(
        container: Container,
        path: &Path,
        n_bytes: u64,
        limits: &Limits,
    ) -> Result<AllPackets, Error> {
        let entries = "packet=stream_index,pts_time,size,flags:packet_side_data=side_data_type";
        let mut args = vec!["-select_streams".into(), "v".into()];
        args.extend(["-show_entries", entries, "-of", "csv=p=0"].map(Into::into));
        args.extend(input_args(container, path, limits));
        let invocation = Invocation::new(installed(Tool::Ffprobe)?, args, limits, 0)
            .with_input(path)
            .with_more_time(Duration::from_secs(n_bytes / MIN_DISK_BYTES_PER_S));
        let mut streams = Vec::new();
        let stderr_tail = read_lines(invocation, |line| add_packet(&mut streams, line, limits))?;
        Ok(AllPackets {
            streams,
            stderr_tail,
        })
    }

    /// Reads the packets from output of ffprobe.
    pub(super) fn from_output(output: &[u8], limits: &Limits) -> Result<AllPackets, Error> {
        let mut streams = Vec::new();
        let mut take = |line: &str| add_packet(&mut streams, line, limits);
        split_lines(output, &mut Vec::new(), &mut take)?;
        Ok(AllPackets {
            streams,
            stderr_tail: String::new(),
        })
    }

    /// Returns the packets of a stream; an empty list if it has none.
    pub(super) fn of_stream(&self, stream_idx: u64) -> Packets {
        let packets = self.find(stream_idx).cloned();
        packets.unwrap_or(Packets::empty(stream_idx))
    }

    /// Returns the number of displayed packets of a stream.
    pub(super) fn n_shown(&self, stream_idx: u64) -> usize {
        self.find(stream_idx).map_or(0, Packets::n_shown)
    }

    fn find(&self, stream_idx: u64) -> Option<&Packets> {
        self.streams.iter().find(|p| p.stream_idx == stream_idx)
    }

    /// Returns whether samples of a stream lie beyond the end of the file, the file ends inside a block, or
    /// its blocks are damaged.
    pub(super) fn is_cut(&self, stream_idx: u64) -> bool {
        let of_stream = format!("stream {stream_idx}, offset ");
        let is_partial = |line: &str| line.contains("partial file") && line.contains(&of_stream);
        let is_broken = |line: &str| STRUCTURE_ERRORS.iter().any(|error| line.contains(error));
        let mut lines = self.stderr_tail.lines();
        lines.any(|line| is_broken(line) || is_partial(line))
    }
}

/// Parses one line about a packet: stream, time, size, flags, side data. Side data may continue on further
/// lines.
fn add_packet(streams: &mut Vec<Packets>, line: &str, limits: &Limits) -> Result<(), Error> {
    let mut cells = line.split(',');
    let numbers = (cells.next().map(str::parse), cells.next(), cells.next());
    let (Some(Ok(stream_idx)), Some(time), Some(size)) = numbers else {
        let is_encrypted = line.contains("Encryption");
        streams.iter_mut().for_each(|p| p.encrypted |= is_encrypted);
        return Ok(());
    };
    let at = streams.iter().position(|p| p.stream_idx == stream_idx);
    let at = at.unwrap_or_else(|| {
        streams.push(Packets::empty(stream_idx));
        streams.len() - 1
    });
    let packets = &mut streams[at];
    packets.encrypted |= line.contains("Encryption");
    if cells.next().unwrap_or_default().contains('D') {
        return Ok(()); // outside the edit list: decoded, never shown
    }
    packets.times_s.push(time.parse().ok());
    packets.is_ambiguous |= size.parse().is_ok_and(|size: u64| size <= MAX_EMPTY_BYTES);
    limits.check_n_frames(packets.n_shown())
}

impl Packets {
    fn empty(stream_idx: u64) -> Packets {
        Packets {
            stream_idx,
            times_s: Vec::new(),
            is_ambiguous: false,
            encrypted: false,
        }
    }

    /// Returns the number of displayed packets.
    pub(super) fn n_shown(&self) -> usize {
        self.times_s.len()
    }

    /// Returns the times in display order. Returns `None` if the packets do not determine them. In that case
    /// a packet has no time, may hold no picture, or is further out of order than any codec allows.
    pub(super) fn shown_s(&self) -> Option<Vec<f64>> {
        let mut shown_s: Vec<f64> = self.times_s.iter().copied().collect::<Option<_>>()?;
        let mut latest_s = f64::MIN;
        let leaps_back = shown_s.iter().any(|&time| {
            latest_s = latest_s.max(time);
            time < latest_s - MAX_REORDER_S
        });
        if self.is_ambiguous || leaps_back {
            return None;
        }
        shown_s.sort_by(f64::total_cmp);
        Some(shown_s)
    }
}

/// The pictures to which a stream decodes.
#[derive(Debug)]
pub(super) struct Pictures {
    /// Times in display order; `None` for a picture without a time.
    pub(super) times_s: Vec<Option<f64>>,
    /// The end of the decoder's stderr.
    pub(super) stderr_tail: String,
}

impl Pictures {
    /// Decodes the stream of the packets and reads the times of its pictures. Fails beyond `limits.max_frames`.
    pub(super) fn read(
        container: Container,
        path: &Path,
        packets: &Packets,
        limits: &Limits,
    ) -> Result<Pictures, Error> {
        let stream = packets.stream_idx.to_string();
        let mut args = vec!["-select_streams".into(), stream.into()];
        let entries = "frame=best_effort_timestamp_time";
        args.extend(["-show_entries", entries, "-of", "csv=p=0"].map(Into::into));
        args.extend(input_args(container, path, limits));
        let (ffprobe, n_frames) = (installed(Tool::Ffprobe)?, packets.n_shown().max(1));
        let invocation = Invocation::new(ffprobe, args, limits, n_frames).with_input(path);
        let mut times_s = Vec::new();
        let stderr_tail = read_lines(invocation, |line| add_picture(&mut times_s, line, limits))?;
        Ok(Pictures {
            times_s,
            stderr_tail,
        })
    }

    /// Reads the times from output of ffprobe.
    pub(super) fn from_output(output: &[u8], limits: &Limits) -> Result<Pictures, Error> {
        let mut times_s = Vec::new();
        let mut take = |line: &str| add_picture(&mut times_s, line, limits);
        split_lines(output, &mut Vec::new(), &mut take)?;
        Ok(Pictures {
            times_s,
            stderr_tail: String::new(),
        })
    }
}

/// Parses one line about a decoded picture: its time, and side data. Side data may continue on further lines.
fn add_picture(times_s: &mut Vec<Option<f64>>, line: &str, limits: &Limits) -> Result<(), Error> {
    let time = line.split(',').next().unwrap_or_default();
    if time == "N/A" || time.parse::<f64>().is_ok() {
        times_s.push(time.parse().ok());
    }
    limits.check_n_frames(times_s.len())
}

/// Runs a tool and passes each line of its output to `take`. Returns its stderr.
fn read_lines(
    invocation: Invocation<'_>,
    mut take: impl FnMut(&str) -> Result<(), Error>,
) -> Result<String, Error> {
    let mut child = Child::reading(invocation)?;
    let (mut chunk, mut line) = (vec![0; 1 << 16], Vec::new());
    loop {
        let n_read = child.read_some(&mut chunk)?;
        if n_read == 0 {
            break;
        }
        split_lines(&chunk[..n_read], &mut line, &mut take)?;
    }
    Ok(child.finish()?.check()?.stderr_tail)
}

/// Splits a piece of output into lines. `line` holds the start of an unfinished line.
fn split_lines(
    piece: &[u8],
    line: &mut Vec<u8>,
    take: &mut impl FnMut(&str) -> Result<(), Error>,
) -> Result<(), Error> {
    for &byte in piece {
        if byte == b'\n' {
            take(&String::from_utf8_lossy(line))?;
            line.clear();
        } else if line.len() < MAX_LINE_BYTES {
            line.push(byte);
        } else {
            return Err(Error::NotAVideo("the data of a packet are too long".into()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::code::Code;

    fn packets(lines: &str) -> Packets {
        let mut streams = Vec::new();
        for line in lines.lines() {
            add_packet(&mut streams, line, &Limits::default()).unwrap();
        }
        let all = AllPackets {
            streams,
            stderr_tail: String::new(),
        };
        all.of_stream(1)
    }

    #[test]
    fn line_in_pieces_is_joined_and_endless_line_refused() {
        let (mut line, mut seen) = (Vec::new(), Vec::new());
        let mut take = |line: &str| {
            seen.push(line.to_owned());
            Ok(())
        };
        for piece in ["0,0.000000,80,K__\n0,0.04", "0000,70,___\n"] {
            split_lines(piece.as_bytes(), &mut line, &mut take).unwrap();
        }
        let endless = [b'x'; MAX_LINE_BYTES + 1];
        let refused = split_lines(&endless, &mut line, &mut take).unwrap_err();
        assert_eq!(refused.code(), Code::NotAVideo);
        assert_eq!(line.len(), MAX_LINE_BYTES);
        assert_eq!(seen, ["0,0.000000,80,K__", "0,0.040000,70,___"]);
    }

    #[test]
    fn packets_are_counted_by_stream_without_discarded_ones() {
        let lines = "0,0.0,99,K__\n1,0.0,99,K__\n1,0.2,99,___\n1,0.1,99,__\n1,0.3,99,_D_\nEncryption info\n";
        let packets = packets(lines);
        assert_eq!(packets.shown_s(), Some(vec![0.0, 0.1, 0.2]));
        assert!(packets.encrypted);
    }

    #[test]
    fn packets_without_times_pictures_or_order_determine_no_times() {
        for unclear in ["1,N/A,99,___", "1,0.2,0,___", "1,-3.0,99,___"] {
            let lines = format!("1,0.0,99,K__\n1,0.1,99,___\n{unclear}\n");
            assert_eq!(packets(&lines).shown_s(), None, "{unclear}");
            assert_eq!(packets(&lines).n_shown(), 3);
        }
    }
}
