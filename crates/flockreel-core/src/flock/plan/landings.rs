//! Jumps of a trellis in the order in which the recursion takes them: by the station at which they land.
//!
//! There is one set of jumps for each direction of time (docs/explanation/algorithms.md, "Planning").

use std::ops::Range;

/// Direction in which the frames of a plan are processed.
///
/// A station is a state numbered in that direction, so that playing on leads from each station to the next.
/// Forward in time the stations are the states in their order, backward in the reverse order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Forward in time.
    Forward,
    /// Backward, from the last frame to the first.
    Backward,
}

impl Pass {
    /// Returns the station of a state, or the state of a station. `n_states` is the number of states.
    pub fn station(self, n_states: usize, state: usize) -> usize {
        match self {
            Pass::Forward => state,
            Pass::Backward => n_states - 1 - state,
        }
    }

    /// Converts a pair of values between the order of two consecutive states and that of their stations.
    pub fn in_station_order<T>(self, [first, second]: [T; 2]) -> [T; 2] {
        match self {
            Pass::Forward => [first, second],
            Pass::Backward => [second, first],
        }
    }

    /// Returns the stations of a range of states, or the states of a range of stations.
    pub fn stations(self, n_states: usize, states: Range<usize>) -> Range<usize> {
        match self {
            Pass::Forward => states,
            Pass::Backward => n_states - states.end..n_states - states.start,
        }
    }
}

/// Landing stations: the stations at which jumps land, sorted by their number of jumps.
#[derive(Clone, Debug, Default)]
pub struct Landings {
    stations: Vec<u32>,
    /// Jumps to each landing station, one station after the other.
    jumps: Vec<Origin>,
    groups: Vec<Group>,
    /// Rank of each station among the landing stations; unspecified for other stations.
    order: Vec<u32>,
}

/// Origin and cost of a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Station from which the jump comes. The origins of one landing station rise.
    pub from: u32,
    /// Cost, in turns.
    pub cost: u32,
}

/// Landing stations with the same number of jumps.
#[derive(Clone, Debug)]
struct Group {
    /// Number of jumps to each station.
    n_jumps: usize,
    stations: Range<usize>,
    /// Index of the first of their jumps.
    first: usize,
}

impl Landings {
    /// Returns the landings of jumps (landing station, origin station, cost). The jumps must be sorted, and
    /// all stations below `n_stations`.
    pub fn new(n_stations: usize, jumps: &[(u32, u32, u32)]) -> Landings {
        let mut into: Vec<&[(u32, u32, u32)]> = jumps.chunk_by(|a, b| a.0 == b.0).collect();
        into.sort_by_key(|into| into.len());
        let mut landings = Landings {
            order: vec![0; n_stations],
            ..Landings::default()
        };
        for alike in into.chunk_by(|a, b| a.len() == b.len()) {
            let first = landings.stations.len();
            landings.groups.push(Group {
                n_jumps: alike[0].len(),
                stations: first..first + alike.len(),
                first: landings.jumps.len(),
            });
            for into in alike {
                landings.order[into[0].0 as usize] = landings.stations.len() as u32;
                landings.stations.push(into[0].0);
                let origins = into.iter().map(|&(_, from, cost)| Origin { from, cost });
                landings.jumps.extend(origins);
            }
        }
        landings
    }

    /// Returns the number of landing stations.
    pub fn n_landings(&self) -> usize {
        self.stations.len()
    }

    /// Returns for each group the number of jumps per station, the stations, and their jumps, one station
    /// after the other.
    pub fn groups(&self) -> impl Iterator<Item = (usize, &[u32], &[Origin])> {
        self.groups.iter().map(|group| {
            let n_jumps = group.n_jumps * group.stations.len();
            (
                group.n_jumps,
                &self.stations[group.stations.clone()],
                &self.jumps[group.first..][..n_jumps],
            )
        })
    }

    /// Returns each landing station with its jumps.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &[Origin])> {
        self.groups().flat_map(|(n_jumps, stations, jumps)| {
            let stations = stations.iter().map(|&station| station as usize);
            stations.zip(jumps.chunks(n_jumps))
        })
    }

    /// Returns the rank of a landing station among all of them.
    pub fn order(&self, station: usize) -> usize {
        self.order[station] as usize
    }

    /// Returns the origin of jump number `rank` to the landing station of rank `order`.
    pub fn origin(&self, order: usize, rank: usize) -> usize {
        let group = self.groups.partition_point(|g| g.stations.end <= order);
        let group = &self.groups[group];
        let jump = group.first + (order - group.stations.start) * group.n_jumps + rank;
        self.jumps[jump].from as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_with_few_jumps_come_first_and_keep_their_origins() {
        let mut jumps: Vec<(u32, u32, u32)> = (10..14).map(|to| (to, to - 9, 4)).collect();
        jumps.extend([(12, 4, 5), (12, 9, 6), (10, 8, 7)]);
        jumps.sort_unstable();
        let landings = Landings::new(20, &jumps);
        let found: Vec<(usize, usize)> = (landings.iter())
            .map(|(station, jumps)| (station, jumps.len()))
            .collect();
        assert_eq!(found, [(11, 1), (13, 1), (10, 2), (12, 3)]);
        let origins = [0, 1, 2].map(|rank| landings.origin(landings.order(12), rank));
        assert_eq!(origins, [3, 4, 9]);
        assert_eq!(landings.origin(landings.order(11), 0), 2);
    }

    #[test]
    fn backward_pass_reverses_states() {
        assert_eq!(Pass::Backward.station(10, 0), 9);
        assert_eq!(Pass::Backward.stations(10, 2..5), 5..8);
        assert_eq!(Pass::Forward.stations(10, 2..5), 2..5);
    }
}
