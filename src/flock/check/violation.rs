//! Violations that the check of a stored plan can find. Each has one sentence and a stable code.

use crate::geometry::Turns;

/// First violation found. Individuals are named by id; frames are output frames, counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// A parameter is out of range.
    #[error("a parameter of the flock is out of range: {0}")]
    Params(String),
    /// Frame rate or picture size of flock and library differ.
    #[error("the flock belongs to another library: its frame rate or picture size differs")]
    OtherLibrary,
    /// Number of individuals found, and the number in `params.count`.
    #[error("the flock has {0} individuals, but params.count is {1}")]
    Count(usize, u32),
    /// Position in the list of individuals, and the id found there.
    #[error("the individual at position {0} has id {1}; ids must count up from 0")]
    Order(usize, u32),
    /// A list does not have one entry per frame.
    #[error("individual {id}: {list} has {found} entries, but params.frames is {wanted}")]
    Length {
        /// Id of the individual.
        id: usize,
        /// Name of the list in the file.
        list: &'static str,
        /// Number of entries found.
        found: usize,
        /// Number of entries wanted.
        wanted: usize,
    },
    /// A source frame is outside of the library's component.
    #[error("individual {id}, frame {t}: source frame {frame} is not in the library's component")]
    OutsideComponent {
        /// Id of the individual.
        id: usize,
        /// Output frame.
        t: usize,
        /// Source frame.
        frame: u32,
    },
    /// A sprite is mirrored although `params.mirror` is false.
    #[error("individual {id}, frame {t}: the sprite is mirrored, but params.mirror is false")]
    Mirror {
        /// Id of the individual.
        id: usize,
        /// Output frame.
        t: usize,
    },
    /// A step leads neither to the next frame nor along a jump of the library.
    #[error(
        "individual {id}, frame {t}: the step from source frame {from} to {to}{} is neither the next frame nor a jump \
         of the library",
        if *.turned { ", changing the mirror side," } else { "" }
    )]
    IllegalStep {
        /// Id of the individual.
        id: usize,
        /// Output frame to which the step leads.
        t: usize,
        /// Source frame before the step.
        from: u32,
        /// Source frame after the step.
        to: u32,
        /// Whether the step changes the mirror side.
        turned: bool,
    },
    /// A jump follows the last one too soon.
    #[error(
        "individual {id}, frame {t}: the jump follows the last one after {since} frames, but the minimum is {dwell}"
    )]
    Dwell {
        /// Id of the individual.
        id: usize,
        /// Output frame to which the jump leads.
        t: usize,
        /// Frames since the last jump.
        since: usize,
        /// Least number of frames between two jumps.
        dwell: usize,
    },
    /// `continues_as` is wrong. In a loop it must be a permutation of the ids; otherwise it must be null.
    #[error(
        "individual {id}: continues_as is wrong; in a loop each individual must be named once, otherwise it must be \
         null"
    )]
    Heir {
        /// Id of the individual.
        id: usize,
    },
    /// A cost in the file is not a whole number of turns (65536 to the circle).
    #[error(
        "individual {id}: {part} is not a whole number of turns (65536 to the circle): {value} rad"
    )]
    NotWhole {
        /// Id of the individual.
        id: usize,
        /// Name of the cost in the file.
        part: &'static str,
        /// Value in the file, in radians.
        value: f64,
    },
    /// A cost in the file differs from the sum over the plan's steps.
    #[error(
        "individual {id}: {part} is {:.6} rad, but the steps of the plan cost {:.6} rad",
        rad(*.said), rad(*.found)
    )]
    Cost {
        /// Id of the individual.
        id: usize,
        /// Name of the cost in the file.
        part: &'static str,
        /// Value in the file, in turns.
        said: u64,
        /// Sum over the steps, in turns.
        found: u64,
    },
    /// A cheaper plan exists.
    #[error(
        "individual {id}, frame {t}: here the plan departs from the cheapest one: it costs {:.6} rad, and {:.6} rad is \
         possible",
        rad(*.cost), rad(*.cheapest)
    )]
    Suboptimal {
        /// Id of the individual.
        id: usize,
        /// First frame whose state makes the cheapest cost unreachable.
        t: usize,
        /// Cost of the plan, in turns.
        cost: u64,
        /// Cost of the cheapest plan, in turns.
        cheapest: u64,
    },
    /// Without crowd cost, a plan costs less than `cost.lower_bound`.
    #[error(
        "individual {id}: cost.lower_bound is {:.6} rad, but a plan of {:.6} rad exists",
        rad(*.said), rad(*.cheapest)
    )]
    LowerBound {
        /// Id of the individual.
        id: usize,
        /// Value in the file, in turns.
        said: u64,
        /// Cost of the cheapest plan without crowd cost, in turns.
        cheapest: u64,
    },
    /// An edge offers less than the certificate says. This is a bug of the check itself.
    #[error(
        "individual {id}, frame {t}: the check itself is faulty: an edge costs less than the certificate allows; \
         report this as a bug"
    )]
    Certificate {
        /// Id of the individual.
        id: usize,
        /// First frame of the edge.
        t: usize,
    },
}

impl Violation {
    /// Returns the stable code of the violation.
    pub fn code(&self) -> &'static str {
        match self {
            Violation::Params(_) => "bad_params",
            Violation::OtherLibrary => "other_library",
            Violation::Count(..) => "wrong_count",
            Violation::Order(..) => "wrong_order",
            Violation::Length { .. } => "wrong_length",
            Violation::OutsideComponent { .. } => "outside_component",
            Violation::Mirror { .. } => "mirror_not_allowed",
            Violation::IllegalStep { .. } => "illegal_step",
            Violation::Dwell { .. } => "dwell_too_short",
            Violation::Heir { .. } => "wrong_heir",
            Violation::NotWhole { .. } => "cost_not_whole",
            Violation::Cost { .. } => "wrong_cost",
            Violation::Suboptimal { .. } => "not_cheapest",
            Violation::LowerBound { .. } => "wrong_lower_bound",
            Violation::Certificate { .. } => "certificate_fails",
        }
    }
}

fn rad(turns: u64) -> f64 {
    turns as f64 / Turns::PER_RAD
}
