//! The time of every packet of one stream: how long the film really is, whether its rate is
//! constant, whether it ends before its header says (RELIABILITY.md, "Facts": believe what is there,
//! not what is claimed).

use std::path::Path;
use std::time::Duration;

use serde_json::Value;

use super::allow_list::input_args;
use super::container::Container;
use super::error::Error;
use super::gate::{Child, Order};
use super::limits::Limits;
use super::probe::{n_streams, number, ratio, text};
use super::timeline::{Timeline, check_extent};
use super::tools::Tool;

/// Disks read at least this fast, bytes a second; the packet times need the whole file.
const SLOWEST_DISK: u64 = 50_000_000;

/// What is said of one packet is shorter, side data and all.
const MAX_LINE_BYTES: usize = 64 << 10;

/// What the packets of a stream say.
pub(super) struct Packets {
    container: Container,
    /// Presentation times of the packets to be shown, ascending; empty when the container has none.
    times_s: Vec<f64>,
    /// Packets to be shown.
    pub(super) n_shown: usize,
    /// Where the last packet's time ends.
    end_s: f64,
    /// ffprobe complained of an end before its time.
    cut: bool,
    /// Some packet is encrypted.
    encrypted: bool,
}

impl Packets {
    /// Reads the times of all packets of a stream, at most as many as the limit.
    pub(super) fn read(
        container: Container,
        path: &Path,
        stream_idx: u64,
        n_bytes: u64,
        limits: &Limits,
    ) -> Result<Packets, Error> {
        let entries = "packet=pts_time,duration_time,flags:packet_side_data=side_data_type";
        let mut args = vec!["-select_streams".into(), stream_idx.to_string().into()];
        args.extend(["-show_entries", entries, "-of", "csv=p=0"].map(Into::into));
        args.extend(input_args(container, path, limits));
        let order = Order::new(Tool::Ffprobe, args, limits, 0)
            .with_input(path)
            .with_more_time(Duration::from_secs(n_bytes / SLOWEST_DISK));
        let mut child = Child::reading(order)?;
        let mut packets = Packets::none(container);
        let (mut chunk, mut line) = (vec![0; 1 << 16], Vec::new());
        loop {
            let n_read = child.read_some(&mut chunk)?;
            if n_read == 0 {
                break;
            }
            packets.add_lines(&chunk[..n_read], &mut line)?;
            if packets.n_shown > limits.max_frames {
                return Err(Error::TooManyFrames {
                    limit: limits.max_frames,
                });
            }
        }
        let end = child.finish()?.check()?;
        if packets.encrypted {
            return Err(Error::Encrypted);
        }
        packets.cut = ["partial file", "File ended prematurely"]
            .iter()
            .any(|s| end.complaint.contains(s));
        packets.times_s.sort_by(f64::total_cmp);
        if packets.times_s.len() < packets.n_shown {
            packets.times_s.clear(); // some have no time: then none can be told
        }
        Ok(packets)
    }

    fn none(container: Container) -> Packets {
        Packets {
            container,
            times_s: Vec::new(),
            n_shown: 0,
            end_s: f64::MIN,
            cut: false,
            encrypted: false,
        }
    }

    /// The next piece of the output; `line` is what came of a line that has not ended.
    fn add_lines(&mut self, piece: &[u8], line: &mut Vec<u8>) -> Result<(), Error> {
        for &byte in piece {
            if byte == b'\n' {
                self.add(&String::from_utf8_lossy(line));
                line.clear();
            } else if line.len() < MAX_LINE_BYTES {
                line.push(byte);
            } else {
                return Err(Error::NotAVideo("a packet is told without an end".into()));
            }
        }
        Ok(())
    }

    /// One line: time, duration, flags, side data, of which the first two may be missing. Side data
    /// may go on for further lines.
    fn add(&mut self, line: &str) {
        self.encrypted |= line.contains("Encryption");
        if !line.contains('_') {
            return; // no flags: the rest of the packet before
        }
        let mut cells = line.split(',');
        let (time_s, duration_s) = (cells.next(), cells.next());
        let flags = cells.next().unwrap_or_default();
        if flags.contains('D') {
            return; // outside the edit list: decoded, never shown
        }
        self.n_shown += 1;
        let parse = |cell: Option<&str>| cell.and_then(|cell| cell.parse::<f64>().ok());
        if let Some(time_s) = parse(time_s) {
            self.times_s.push(time_s);
            self.end_s = self.end_s.max(time_s + parse(duration_s).unwrap_or(0.0));
        }
    }

    /// The timeline of these packets, within the limits.
    pub(super) fn timeline(&self, stream: &Value, limits: &Limits) -> Result<Timeline, Error> {
        if self.n_shown < limits.min_frames && !self.cut {
            return Err(Error::TooFewFrames {
                n_frames: self.n_shown,
            });
        }
        let rate = |name: &str| ratio(text(&stream[name]), '/').filter(|fps| *fps > 0.0);
        let claimed: Vec<f64> = [rate("avg_frame_rate"), rate("r_frame_rate")]
            .into_iter()
            .flatten()
            .collect();
        let tick_s = ratio(text(&stream["time_base"]), '/').unwrap_or(0.001);
        let timeline = Timeline::of(&self.times_s, &claimed, tick_s, limits)?
            .or_else(|| {
                claimed.first().map(|&fps| Timeline::Constant {
                    fps,
                    ragged_s: Vec::new(),
                })
            })
            .ok_or(Error::TooFewFrames {
                n_frames: self.n_shown,
            })?;
        let n_frames = match &timeline {
            Timeline::Constant { .. } => self.n_shown,
            Timeline::Variable { sources, .. } => sources.len(),
        };
        let fps = timeline.fps();
        check_extent(n_frames as f64 / fps, fps, limits)?;
        Ok(timeline)
    }

    /// Compares what is there with what the header promised.
    pub(super) fn check_whole(
        &self,
        header: &Value,
        stream: &Value,
        timeline: &Timeline,
    ) -> Result<(), Error> {
        let step_s = 1.0 / timeline.fps();
        // An AVI's duration is mended by its reader to fit the file; its count of frames is not.
        let counted_s = (self.container == Container::Avi).then(|| {
            Some(number(&stream["nb_frames"])? / ratio(text(&stream["avg_frame_rate"]), '/')?)
        });
        let own_s = counted_s
            .flatten()
            .or_else(|| number(&stream["duration"]))
            .or_else(|| clock(text(&stream["tags"]["DURATION"])));
        // The format's duration is that of its longest stream: sound may outlast the picture.
        let whole_s = number(&header["format"]["duration"]);
        let (promised_s, slack) = match (own_s, whole_s) {
            (Some(own_s), _) => (own_s, 0.01),
            (None, Some(whole_s)) if n_streams(header) == 1 => (whole_s, 0.01),
            (None, Some(whole_s)) => (whole_s, 0.05),
            (None, None) => (0.0, 0.0),
        };
        let span_s = match (self.times_s.first(), self.times_s.last()) {
            (Some(first), Some(last)) => (last - first + step_s).max(self.end_s).max(last + step_s),
            _ => self.n_shown as f64 * step_s,
        };
        // Of an ASF that does not fill its own size, ffprobe tells no length at all.
        let untold = self.container == Container::Asf && promised_s == 0.0;
        if self.cut || untold || promised_s - span_s > (slack * promised_s).max(2.5 * step_s) {
            return Err(Error::Truncated {
                found: span_s,
                promised: promised_s,
                unit: "s",
            });
        }
        Ok(())
    }
}

/// `00:00:15.400000000` in seconds.
fn clock(text: &str) -> Option<f64> {
    text.split(':').try_fold(0.0, |sum, part| {
        Some(sum * 60.0 + part.parse::<f64>().ok()?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Code;

    #[test]
    fn a_line_may_come_in_pieces_but_must_end() {
        let mut packets = Packets::none(Container::Matroska);
        let mut line = Vec::new();
        for piece in ["0.000000,0.04,K__\n0.04", "0000,0.04,___\n"] {
            packets.add_lines(piece.as_bytes(), &mut line).unwrap();
        }
        assert_eq!(packets.times_s, [0.0, 0.04]);
        let endless = [b'x'; MAX_LINE_BYTES + 1];
        let refused = packets.add_lines(&endless, &mut line).unwrap_err();
        assert_eq!(refused.code(), Code::NotAVideo);
        assert_eq!(line.len(), MAX_LINE_BYTES);
    }
}
