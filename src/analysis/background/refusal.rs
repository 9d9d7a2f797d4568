//! Footage that cannot become a library, told from frames spread through it before any tracking
//! (ALGORITHMS.md 2.9).

use crate::analysis::params::Follow;
use crate::analysis::{Error, Params};
use crate::geometry::Rect;
use crate::raster::runs::Component;

/// Least area of something that moves.
const LEAST_AREA_PX: u64 = 12;
/// Something must move in this share of the frames.
const MOVING_SHARE: f64 = 0.05;
/// More than this share of the pixels ...
const BUSY_AREA: f64 = 0.15;
/// ... in this share of the frames is a moving background; and a second animal in this share counts.
pub(super) const OFTEN: f64 = 0.3;
/// A second component of this share of the largest one's area may be a second animal.
const COMPARABLE: f64 = 0.5;

/// Judges a footage by the components of some of its frames; `is_shadow` tells whether one of frame
/// k's components looks like the plate, only darker. Returns whether several animals move, where that is no
/// reason to refuse.
pub(super) fn judge(
    components: &[Vec<Component>],
    n_px: usize,
    params: &Params,
    is_shadow: impl Fn(usize, &Component) -> bool,
) -> Result<bool, Error> {
    let share = |n: usize| n as f64 / components.len() as f64;
    let busy = |found: &&Vec<Component>| {
        found.iter().map(|c| c.area).sum::<u64>() as f64 > BUSY_AREA * n_px as f64
    };
    if share(components.iter().filter(busy).count()) > OFTEN {
        return Err(Error::BackgroundNotStatic);
    }
    let moves = |found: &&Vec<Component>| found.iter().any(|c| c.area >= LEAST_AREA_PX);
    if share(components.iter().filter(moves).count()) < MOVING_SHARE {
        return Err(Error::NothingMoves);
    }
    let several = components
        .iter()
        .enumerate()
        .filter(|(k, found)| shows_several(found, |c| is_shadow(*k, c)));
    let several = share(several.count()) > OFTEN;
    if several && params.follow == Follow::One {
        return Err(Error::SeveralAnimals);
    }
    Ok(several)
}

/// Whether two components of comparable area lie farther apart than either is long, neither of them
/// the other's shadow.
fn shows_several(found: &[Component], is_shadow: impl Fn(&Component) -> bool) -> bool {
    let Some(first) = found.iter().max_by_key(|c| c.area) else {
        return false;
    };
    let second = found.iter().find(|c| {
        c.area as f64 >= COMPARABLE * first.area as f64
            && c.area >= LEAST_AREA_PX
            && gap_px(&c.rect, &first.rect)
                > first.rect.w.max(first.rect.h).min(c.rect.w.max(c.rect.h))
    });
    second.is_some_and(|second| is_shadow(second) == is_shadow(first))
}

/// The distance between two boxes, the longer way of x and y; 0 where they meet.
fn gap_px(a: &Rect, b: &Rect) -> u32 {
    let apart =
        |a0: u32, a1: u32, b0: u32, b1: u32| b0.saturating_sub(a1).max(a0.saturating_sub(b1));
    apart(a.x, a.right(), b.x, b.right()).max(apart(a.y, a.bottom(), b.y, b.bottom()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(x: u32, y: u32, side: u32) -> Component {
        Component {
            runs: vec![],
            area: u64::from(side * side),
            rect: Rect {
                x,
                y,
                w: side,
                h: side,
            },
        }
    }

    fn judged(frames: &[Vec<Component>]) -> Result<bool, Error> {
        judge(frames, 10_000, &Params::default(), |_, _| false)
    }

    #[test]
    fn each_refusal_has_its_reason() {
        let one = vec![component(10, 10, 10)];
        let two = vec![component(10, 10, 10), component(60, 10, 9)];
        assert!(judged(&vec![one.clone(); 10]).is_ok());
        assert!(matches!(
            judged(&vec![vec![]; 10]),
            Err(Error::NothingMoves)
        ));
        assert!(matches!(
            judged(&vec![two.clone(); 10]),
            Err(Error::SeveralAnimals)
        ));
        assert!(matches!(
            judged(&vec![vec![component(0, 0, 50)]; 10]),
            Err(Error::BackgroundNotStatic)
        ));
    }

    #[test]
    fn several_animals_are_told_of_when_the_largest_is_to_be_followed() {
        let two = vec![component(10, 10, 10), component(60, 10, 9)];
        let params = Params {
            follow: Follow::Largest,
            ..Params::default()
        };
        let judged = |frames: &[Vec<Component>]| judge(frames, 10_000, &params, |_, _| false);
        assert!(matches!(judged(&vec![two; 10]), Ok(true)));
        let one = vec![component(10, 10, 10)];
        assert!(matches!(judged(&vec![one; 10]), Ok(false)));
    }

    #[test]
    fn a_second_animal_now_and_then_is_let_pass() {
        let (one, two) = (
            vec![component(10, 10, 10)],
            vec![component(10, 10, 10), component(60, 10, 9)],
        );
        assert!(judged(&[vec![two; 2], vec![one; 8]].concat()).is_ok());
    }

    #[test]
    fn an_animal_in_two_parts_is_one_animal() {
        let parts = vec![component(10, 10, 10), component(10, 23, 9)];
        assert!(judged(&vec![parts; 10]).is_ok());
    }
}
