//! MOTChallenge files gt/gt.txt and seqinfo.ini. Frames, identities and coordinates count from 1, as its
//! tools expect; boxes are amodal (docs/reference/formats.md, "Ground truth").

use std::io::{self, Write};

use super::{FilmShape, with_truth};
use crate::flock::Flock;
use crate::flock::composite::truth::FrameTruth;
use crate::geometry::rounded;

/// Writes the lines of one frame, for all individuals at least partly in the picture, hidden or not.
///
/// `number` is the number of the picture, from 0. The columns are frame, identity, left, top, width, height, 1
/// (counts), 1 (class), visibility.
pub fn write_frame(
    out: &mut impl Write,
    flock: &Flock,
    number: usize,
    truth: &FrameTruth,
) -> io::Result<()> {
    for (individual, seen) in with_truth(flock, truth) {
        let Some([x, y, w, h]) = seen.amodal_box else {
            continue;
        };
        if !seen.silhouette.bits.contains(&1) {
            continue;
        }
        writeln!(
            out,
            "{},{},{},{},{w},{h},1,1,{}",
            number + 1,
            individual.id + 1,
            x + 1,
            y + 1,
            rounded(seen.visibility, 4)
        )?;
    }
    Ok(())
}

/// Returns seqinfo.ini of a sequence whose pictures lie in `folder` and have names with `extension`.
pub fn sequence(film: &FilmShape, name: &str, folder: &str, extension: &str) -> String {
    let [width, height] = film.size_px;
    format!(
        "[Sequence]\nname={name}\nimDir={folder}\nframeRate={}\nseqLength={}\nimWidth={width}\n\
         imHeight={height}\nimExt=.{extension}\n",
        film.fps, film.n_frames
    )
}
