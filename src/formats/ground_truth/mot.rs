//! MOTChallenge: gt/gt.txt and seqinfo.ini. Frames, identities and places count from 1, as its tools
//! expect; boxes are those of the whole animal (ALGORITHMS.md 8).

use std::io::{self, Write};

use super::{FilmShape, everyone};
use crate::flock::Flock;
use crate::flock::composite::truth::FrameTruth;
use crate::formats::poses_json::round;

/// The lines of one frame: everyone of whom anything is in the picture.
///
/// The columns are frame, identity, left, top, width, height, 1 (counts), 1 (class), visibility.
pub fn write_frame(
    out: &mut impl Write,
    flock: &Flock,
    frame_idx: usize,
    truth: &FrameTruth,
) -> io::Result<()> {
    for (individual, seen) in everyone(flock, truth) {
        let Some([x, y, w, h]) = seen.amodal_box else {
            continue;
        };
        if !seen.silhouette.bits.contains(&1) {
            continue;
        }
        writeln!(
            out,
            "{},{},{},{},{w},{h},1,1,{}",
            frame_idx + 1,
            individual.id + 1,
            x + 1,
            y + 1,
            round(seen.visibility, 4)
        )?;
    }
    Ok(())
}

/// seqinfo.ini.
pub fn sequence(film: &FilmShape) -> String {
    let [width, height] = film.size_px;
    format!(
        "[Sequence]\nname=flock\nimDir=img1\nframeRate={}\nseqLength={}\nimWidth={width}\n\
         imHeight={height}\nimExt=.png\n",
        film.fps, film.n_frames
    )
}
