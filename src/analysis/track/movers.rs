//! What moves besides the animal: where, when, and of what kind.

use crate::analysis::subject::{FITS, Look, Subject};
use crate::geometry::Rect;
use crate::library::{Mover, MoverKind};

/// A mover is seen for at least this long, seconds.
const LEAST_S: f64 = 0.3;
/// And in this many frames.
const LEAST_SEEN: usize = 3;
/// Two sightings of one mover lie at most this far apart, seconds.
const GAP_S: f64 = 1.0;

/// A component of one frame that may be a mover.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Other {
    box_px: Rect,
    on_border: bool,
    is_like_animal: bool,
    is_image: bool,
}

impl Other {
    /// What a look says of a mover.
    pub(super) fn of(look: &Look, subject: &Subject, is_image: bool) -> Other {
        Other {
            box_px: look.box_px,
            on_border: look.on_border,
            is_like_animal: subject.cost(look) < FITS,
            is_image,
        }
    }
}

/// The others of a frame that are not the animal.
pub(super) fn beside(others: &[Other], animal: Option<Rect>) -> Vec<Other> {
    let apart = |other: &&Other| {
        animal.is_none_or(|animal| {
            2 * animal.intersection(&other.box_px).area() < other.box_px.area()
        })
    };
    others.iter().filter(apart).cloned().collect()
}

/// A mover while it is followed.
struct Open {
    last: Rect,
    first_s: f64,
    last_s: f64,
    whole: Rect,
    smallest_px: u64,
    n_seen: usize,
    n_border: usize,
    n_like: usize,
    n_images: usize,
}

impl Open {
    fn of(other: &Other, time_s: f64) -> Open {
        Open {
            last: other.box_px,
            first_s: time_s,
            last_s: time_s,
            whole: other.box_px,
            smallest_px: other.box_px.area(),
            n_seen: 1,
            n_border: usize::from(other.on_border),
            n_like: usize::from(other.is_like_animal),
            n_images: usize::from(other.is_image),
        }
    }

    fn add(&mut self, other: &Other, time_s: f64) {
        self.last = other.box_px;
        self.last_s = time_s;
        self.whole = self.whole.union(&other.box_px);
        self.smallest_px = self.smallest_px.min(other.box_px.area());
        self.n_seen += 1;
        self.n_border += usize::from(other.on_border);
        self.n_like += usize::from(other.is_like_animal);
        self.n_images += usize::from(other.is_image);
    }

    /// Whether something seen now is the same mover.
    fn is_near(&self, other: &Other) -> bool {
        let margin = other.box_px.w.max(other.box_px.h);
        let reach = other.box_px.inflated(margin, u32::MAX / 2, u32::MAX / 2);
        !self.last.intersection(&reach).is_empty()
    }

    fn is_long(&self) -> bool {
        self.n_seen >= LEAST_SEEN && self.last_s - self.first_s >= LEAST_S
    }

    fn finished(self) -> Mover {
        let kind = match () {
            () if 2 * self.n_images > self.n_seen => MoverKind::MirrorImage,
            () if 2 * self.n_border > self.n_seen => MoverKind::FromBorder,
            () if 2 * self.n_like > self.n_seen => MoverKind::Animal,
            () if self.whole.area() < 4 * self.smallest_px => MoverKind::InPlace,
            () => MoverKind::Other,
        };
        Mover {
            kind,
            from_s: self.first_s,
            to_s: self.last_s,
            box_px: self.whole,
        }
    }
}

/// The movers of a film, from what was seen besides the animal in each frame, by their first time.
pub(super) fn gathered(frames: &[Vec<Other>], times_s: &[f64]) -> Vec<Mover> {
    let (mut open, mut done): (Vec<Open>, Vec<Open>) = (Vec::new(), Vec::new());
    for (others, &time_s) in frames.iter().zip(times_s) {
        for other in others {
            match open.iter_mut().find(|known| known.is_near(other)) {
                Some(known) => known.add(other, time_s),
                None => open.push(Open::of(other, time_s)),
            }
        }
        let (over, going): (Vec<Open>, Vec<Open>) =
            open.into_iter().partition(|o| time_s - o.last_s > GAP_S);
        done.extend(over);
        open = going;
    }
    done.extend(open);
    let mut movers: Vec<Mover> = done
        .into_iter()
        .filter(Open::is_long)
        .map(Open::finished)
        .collect();
    movers.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    movers
}
