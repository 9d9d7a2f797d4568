//! Advice on a finished flock: too many animals for the tank, a loop that is too short, or animals that keep no
//! company.

use super::Flock;
use super::params::Rules;

/// 90th percentile of the heading error above which a loop counts as too short, radians. Free choice.
const SHORT_LOOP_RAD: f64 = 0.35;

/// Advice on a flock. Its text is a sentence for users.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Advice {
    /// The flock has more individuals than the tank has room for.
    #[error(
        "the tank has room for about {room_for} of the {count} animals, so some overlap or rest where the filmed \
         animal never rested: request fewer animals, or film from a greater distance"
    )]
    LittleRoom {
        /// Number of individuals that the tank has room for.
        room_for: u32,
        /// Number of individuals.
        count: usize,
    },
    /// The animals do not school.
    #[error(
        "each animal goes its own way, as one does that stands, walks or is filmed from above: set `rules.sociality` to \
         1 (or choose the preset `school`) for a school"
    )]
    NoSchool,
    /// The loop is too short for the animals to return to where they started.
    #[error(
        "the loop of {length_s:.1} s is too short for the animals to return to their start: in a tenth of the frames \
         the heading is off by {off_deg:.0} degrees or more; request more frames"
    )]
    ShortLoop {
        /// Length of the loop, seconds.
        length_s: f64,
        /// 90th percentile of the difference between shown and requested headings, degrees.
        off_deg: f64,
    },
}

impl Advice {
    /// Returns all advice that applies to a flock.
    pub fn all(flock: &Flock) -> Vec<Advice> {
        let (count, room_for) = (flock.individuals.len(), flock.stats.room_for);
        let is_full = room_for > 0 && count > room_for as usize;
        let little_room = is_full.then_some(Advice::LittleRoom { room_for, count });
        let error_rad = flock.stats.heading_error_p90_rad;
        let is_short = flock.params.is_loop && error_rad > SHORT_LOOP_RAD;
        let short_loop = is_short.then(|| Advice::ShortLoop {
            length_s: f64::from(flock.params.frames) / flock.fps,
            off_deg: error_rad.to_degrees(),
        });
        // Other rules were chosen by the user, who needs no advice on them.
        let alone = Rules {
            sociality: Some(0.0),
            ..Rules::default()
        };
        let goes_alone = count > 1 && flock.params.rules == alone;
        let no_school = goes_alone.then_some(Advice::NoSchool);
        let all = [little_room, short_loop, no_school];
        all.into_iter().flatten().collect()
    }

    /// Returns the stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Advice::LittleRoom { .. } => "little_room",
            Advice::ShortLoop { .. } => "short_loop",
            Advice::NoSchool => "no_school",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;

    #[test]
    fn advice_names_too_many_animals_and_too_short_a_loop() {
        let library = synthetic::library(View::Top);
        let params = Params {
            count: Some(3),
            frames: 40,
            is_loop: true,
            ..Params::default()
        };
        let mut flock = plan_flock(&library, &params, &Silent).expect("a good library");
        flock.stats.room_for = 2;
        flock.params.rules.sociality = Some(0.0);
        flock.stats.heading_error_p90_rad = 1.0;
        let advice: Vec<_> = Advice::all(&flock)
            .iter()
            .map(|a| (a.code(), a.to_string()))
            .collect();
        let [
            ("little_room", room),
            ("short_loop", short),
            ("no_school", alone),
        ] = &advice[..]
        else {
            panic!("{advice:?}");
        };
        assert!(alone.contains("goes its own way"), "{alone}");
        assert!(room.contains("room for about 2 of the 3 animals"), "{room}");
        assert!(
            short.contains("loop of 1.3 s") && short.contains(" 57 degrees"),
            "{short}"
        );
        flock.stats.room_for = 3;
        flock.params.is_loop = false;
        flock.params.rules.sociality = Some(1.0);
        assert!(Advice::all(&flock).is_empty());
    }
}
