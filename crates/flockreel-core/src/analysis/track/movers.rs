//! Gathers the things that move besides the animal: place, time and kind.
//!
//! Components of successive frames with boxes close to each other form one mover. The kind is that of most of
//! its sightings.

use crate::analysis::subject::{FITS, Look, Subject};
use crate::geometry::Rect;
use crate::library::{Disturbance, DisturbanceKind, Mover, MoverKind};

/// Least duration of a mover, seconds. Free choice.
const MIN_DURATION_S: f64 = 0.3;
/// Least number of frames of a mover. Free choice.
const MIN_SIGHTINGS: usize = 3;
/// Longest gap between two sightings of one mover, seconds. Free choice.
const MAX_GAP_S: f64 = 1.0;

/// A component of one frame that may be a mover.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MoverSighting {
    box_px: Rect,
    on_border: bool,
    is_like_animal: bool,
    is_image: bool,
}

impl MoverSighting {
    /// Returns the component that `look` describes; `is_image` marks a mirror image of the animal.
    pub(super) fn new(look: &Look, subject: &Subject, is_image: bool) -> MoverSighting {
        MoverSighting {
            box_px: look.box_px,
            on_border: look.on_border,
            is_like_animal: subject.cost(look) < FITS,
            is_image,
        }
    }
}

/// Returns the components of which less than half lies in the animal's box.
pub(super) fn outside_animal(others: &[MoverSighting], animal: Option<Rect>) -> Vec<MoverSighting> {
    let apart = |other: &&MoverSighting| {
        animal.is_none_or(|animal| {
            2 * animal.intersection(&other.box_px).area() < other.box_px.area()
        })
    };
    others.iter().filter(apart).cloned().collect()
}

/// A mover that may continue in the next frame.
struct OpenMover {
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

impl OpenMover {
    fn new(other: &MoverSighting, time_s: f64) -> OpenMover {
        OpenMover {
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

    fn add(&mut self, other: &MoverSighting, time_s: f64) {
        self.last = other.box_px;
        self.last_s = time_s;
        self.whole = self.whole.union(&other.box_px);
        self.smallest_px = self.smallest_px.min(other.box_px.area());
        self.n_seen += 1;
        self.n_border += usize::from(other.on_border);
        self.n_like += usize::from(other.is_like_animal);
        self.n_images += usize::from(other.is_image);
    }

    /// Returns whether a component of the next frame belongs to this mover.
    fn is_near(&self, other: &MoverSighting) -> bool {
        let margin = other.box_px.w.max(other.box_px.h);
        let reach = other.box_px.inflated(margin, u32::MAX / 2, u32::MAX / 2);
        !self.last.intersection(&reach).is_empty()
    }

    fn is_long(&self) -> bool {
        self.n_seen >= MIN_SIGHTINGS && self.last_s - self.first_s >= MIN_DURATION_S
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

/// Returns the movers of a film by the time of their first sighting, from the other components of each frame.
pub(super) fn gather(frames: &[Vec<MoverSighting>], times_s: &[f64]) -> Vec<Mover> {
    let (mut open, mut done): (Vec<OpenMover>, Vec<OpenMover>) = (Vec::new(), Vec::new());
    for (others, &time_s) in frames.iter().zip(times_s) {
        for other in others {
            match open.iter_mut().find(|known| known.is_near(other)) {
                Some(known) => known.add(other, time_s),
                None => open.push(OpenMover::new(other, time_s)),
            }
        }
        let (over, going): (Vec<OpenMover>, Vec<OpenMover>) = open
            .into_iter()
            .partition(|o| time_s - o.last_s > MAX_GAP_S);
        done.extend(over);
        open = going;
    }
    done.extend(open);
    let mut movers: Vec<Mover> = done
        .into_iter()
        .filter(OpenMover::is_long)
        .map(OpenMover::finished)
        .collect();
    movers.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    movers
}

/// Returns the times in which frames are disturbed, by the kind of each frame. Gaps and durations are those of movers.
pub(super) fn disturbances(
    frames: &[Option<DisturbanceKind>],
    times_s: &[f64],
) -> Vec<Disturbance> {
    let of_kind = |kind: DisturbanceKind| {
        let frames = frames.iter().zip(times_s);
        let times: Vec<f64> = frames
            .filter(|(frame, _)| **frame == Some(kind))
            .map(|(_, &time_s)| time_s)
            .collect();
        let spans = times.chunk_by(|a, b| b - a <= MAX_GAP_S);
        let told = spans.map(|span| (span.len(), span[0], span[span.len() - 1]));
        told.filter(|&(n, from_s, to_s)| n >= MIN_SIGHTINGS && to_s - from_s >= MIN_DURATION_S)
            .map(|(_, from_s, to_s)| Disturbance { kind, from_s, to_s })
            .collect::<Vec<_>>()
    };
    [DisturbanceKind::Camera, DisturbanceKind::Light]
        .map(of_kind)
        .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FPS: f64 = 30.0;

    fn at(x: u32, y: u32, w: u32, h: u32) -> MoverSighting {
        MoverSighting {
            box_px: Rect { x, y, w, h },
            on_border: false,
            is_like_animal: false,
            is_image: false,
        }
    }

    /// Returns the movers of 90 frames with the components `seen(frame)`.
    fn movers_of(seen: impl Fn(u32) -> Vec<MoverSighting>) -> Vec<Mover> {
        let frames: Vec<Vec<MoverSighting>> = (0..90).map(seen).collect();
        let times_s: Vec<f64> = (0..90).map(|k| f64::from(k) / FPS).collect();
        gather(&frames, &times_s)
    }

    #[test]
    fn hand_that_enters_and_leaves_is_one_mover() {
        let hand = |k: u32| {
            let reach = 10 + 2 * (k - 30).min(60 - k);
            let hand = MoverSighting {
                on_border: true,
                ..at(100, 0, 20, reach)
            };
            vec![hand]
        };
        let movers = movers_of(|k| {
            if (30..60).contains(&k) {
                hand(k)
            } else {
                Vec::new()
            }
        });
        let [mover] = &movers[..] else {
            panic!("{movers:?}")
        };
        assert_eq!(mover.kind, MoverKind::FromBorder);
        assert_eq!((mover.from_s, mover.to_s), (1.0, 59.0 / FPS));
        assert_eq!(
            mover.box_px,
            Rect {
                x: 100,
                y: 0,
                w: 20,
                h: 40
            }
        );
    }

    #[test]
    fn brief_sightings_are_no_mover() {
        assert_eq!(
            movers_of(|k| if k < 8 {
                vec![at(5, 5, 9, 9)]
            } else {
                Vec::new()
            }),
            []
        );
        let twice = |k| {
            if k == 0 || k == 20 {
                vec![at(5, 5, 9, 9)]
            } else {
                Vec::new()
            }
        };
        assert_eq!(movers_of(twice), [], "two frames are too few");
    }

    #[test]
    fn returning_mover_is_listed_twice_in_order_of_time() {
        let seen = |k: u32| match k {
            0..20 => vec![at(50, 50, 10, 10)],
            20..60 => vec![at(200, 80, 10, 10)],
            60.. => vec![at(50, 50, 10, 10)],
        };
        let times: Vec<f64> = movers_of(seen).iter().map(|mover| mover.from_s).collect();
        assert_eq!(times, [0.0, 20.0 / FPS, 2.0]);
    }

    #[test]
    fn kind_is_that_of_most_sightings() {
        let kind = |seen: &dyn Fn(u32) -> MoverSighting| movers_of(|k| vec![seen(k)])[0].kind;
        let runs = |k: u32| at(10 + 3 * k, 40, 12, 8);
        let image = |k| MoverSighting {
            is_image: k % 3 > 0,
            ..runs(k)
        };
        let like = |k| MoverSighting {
            is_like_animal: k % 3 > 0,
            ..runs(k)
        };
        assert_eq!(kind(&image), MoverKind::MirrorImage);
        assert_eq!(kind(&like), MoverKind::Animal);
        assert_eq!(kind(&|k| at(10 + k % 3, 40, 12, 8)), MoverKind::InPlace);
        assert_eq!(kind(&runs), MoverKind::Other);
    }

    #[test]
    fn components_in_the_animals_box_are_no_movers() {
        let animal = Rect {
            x: 10,
            y: 10,
            w: 40,
            h: 20,
        };
        let others = [at(15, 12, 10, 10), at(45, 12, 20, 10), at(200, 5, 10, 10)];
        assert_eq!(outside_animal(&others, Some(animal)), others[1..]);
        assert_eq!(outside_animal(&others, None), others);
    }
}
