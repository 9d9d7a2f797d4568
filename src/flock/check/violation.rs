//! What can be wrong with a stored plan, one clear sentence each, with a stable code.

use crate::geometry::Turns;

/// The first thing found wrong. Individuals are named by id, frames are output frames from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Violation {
    /// The parameters are out of range.
    #[error("the flock's params: {0}")]
    Params(String),
    /// The flock was made of another library.
    #[error("the flock was made of another library: frame rate or picture size differ")]
    OtherLibrary,
    /// Individuals there are, and as `params.count` has it.
    #[error("there are {0} individuals where params.count says {1}")]
    Count(usize, u32),
    /// The place, and the id found there.
    #[error("individual {1} stands in the place of individual {0}")]
    Order(usize, u32),
    /// A list has not one entry for each frame of the flock.
    #[error("individual {id}: {list} has {found} entries where params.frames says {wanted}")]
    Length {
        /// Whose.
        id: usize,
        /// The list's name in the file.
        list: &'static str,
        /// Entries there are.
        found: usize,
        /// Entries there should be.
        wanted: usize,
    },
    /// A frame that playback does not show.
    #[error("individual {id}, frame {t}: source frame {frame} is not in the library's component")]
    OutsideComponent {
        /// Whose.
        id: usize,
        /// When.
        t: usize,
        /// The source frame.
        frame: u32,
    },
    /// A mirror image where none is allowed.
    #[error("individual {id}, frame {t}: mirrored, which params.mirror does not allow")]
    Mirror {
        /// Whose.
        id: usize,
        /// When.
        t: usize,
    },
    /// A step that is neither the next frame nor a jump.
    #[error(
        "individual {id}, frame {t}: from source frame {from} to {to}{} is neither the next frame nor a jump of the library",
        if *.turned { ", changing the mirror side," } else { "" }
    )]
    IllegalStep {
        /// Whose.
        id: usize,
        /// The frame stepped to.
        t: usize,
        /// The source frame before.
        from: u32,
        /// The source frame after.
        to: u32,
        /// The mirror side changes.
        turned: bool,
    },
    /// A jump too soon after the last one.
    #[error(
        "individual {id}, frame {t}: jumps {since} frames after its last jump, the least is {dwell}"
    )]
    Dwell {
        /// Whose.
        id: usize,
        /// The frame jumped to.
        t: usize,
        /// Frames since the last jump.
        since: usize,
        /// Frames there must be.
        dwell: usize,
    },
    /// In a loop everybody goes on as somebody, no two as the same; without, nobody does.
    #[error(
        "individual {id}: continues_as does not say, as params.loop has it, whose first frame follows its last"
    )]
    Heir {
        /// Whose.
        id: usize,
    },
    /// A cost that is no sum of integers.
    #[error("individual {id}: {part} is no whole number of 65536ths of a circle: {value} rad")]
    NotWhole {
        /// Whose.
        id: usize,
        /// The part's name in the file.
        part: &'static str,
        /// What the file says.
        value: f64,
    },
    /// A cost that is not what the plan's steps add up to.
    #[error(
        "individual {id}: {part} says {:.6} rad, the plan's steps add up to {:.6} rad",
        rad(*.said), rad(*.found)
    )]
    Cost {
        /// Whose.
        id: usize,
        /// The part's name in the file.
        part: &'static str,
        /// What the file says, turns.
        said: u64,
        /// What was summed, turns.
        found: u64,
    },
    /// A cheaper plan exists.
    #[error(
        "individual {id}, frame {t}: here the plan leaves the cheapest way: it costs {:.6} rad where {:.6} rad is possible",
        rad(*.cost), rad(*.cheapest)
    )]
    Suboptimal {
        /// Whose.
        id: usize,
        /// The first frame after which no way is as cheap as the cheapest.
        t: usize,
        /// The plan's cost, turns.
        cost: u64,
        /// The cheapest plan's cost, turns.
        cheapest: u64,
    },
    /// A plan cheaper than the bound exists, crowd aside.
    #[error(
        "individual {id}: cost.lower_bound says {:.6} rad, yet a plan of {:.6} rad is possible",
        rad(*.said), rad(*.cheapest)
    )]
    LowerBound {
        /// Whose.
        id: usize,
        /// What the file says, turns.
        said: u64,
        /// The cheapest plan's cost without the crowd, turns.
        cheapest: u64,
    },
    /// An edge offers less than the certificate says: a mistake of the check itself.
    #[error("individual {id}, frame {t}: an edge offers less than the certificate says")]
    Certificate {
        /// Whose.
        id: usize,
        /// The edge's first frame.
        t: usize,
    },
}

impl Violation {
    /// The stable name.
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
