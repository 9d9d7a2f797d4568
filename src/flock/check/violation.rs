//! Violations that the check of a stored plan can find. Each has one sentence and a stable code.

use crate::geometry::Turns;

/// First violation found. Individuals are named by id; frames are output frames, counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// A parameter is out of range.
    #[error("the flock's params: {0}")]
    Params(String),
    /// Frame rate or picture size of flock and library differ.
    #[error("the flock was made of another library: frame rate or picture size differ")]
    OtherLibrary,
    /// Number of individuals found, and the number in `params.count`.
    #[error("there are {0} individuals where params.count says {1}")]
    Count(usize, u32),
    /// Position in the list of individuals, and the id found there.
    #[error("individual {1} stands in the place of individual {0}")]
    Order(usize, u32),
    /// A list does not have one entry per frame.
    #[error("individual {id}: {list} has {found} entries where params.frames says {wanted}")]
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
    #[error("individual {id}, frame {t}: mirrored, which params.mirror does not allow")]
    Mirror {
        /// Id of the individual.
        id: usize,
        /// Output frame.
        t: usize,
    },
    /// A step leads neither to the next frame nor along a jump of the library.
    #[error(
        "individual {id}, frame {t}: from source frame {from} to {to}{} is neither the next frame nor a jump of the library",
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
        "individual {id}, frame {t}: jumps {since} frames after its last jump, the least is {dwell}"
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
        "individual {id}: continues_as does not say, as params.loop has it, whose first frame follows its last"
    )]
    Heir {
        /// Id of the individual.
        id: usize,
    },
    /// A cost in the file is not a whole number of turns (65536 to the circle).
    #[error("individual {id}: {part} is no whole number of 65536ths of a circle: {value} rad")]
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
        "individual {id}: {part} says {:.6} rad, the plan's steps add up to {:.6} rad",
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
        "individual {id}, frame {t}: here the plan leaves the cheapest way: it costs {:.6} rad where {:.6} rad is possible",
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
        "individual {id}: cost.lower_bound says {:.6} rad, yet a plan of {:.6} rad is possible",
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
    #[error("individual {id}, frame {t}: an edge offers less than the certificate says")]
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
