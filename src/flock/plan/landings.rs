//! The jumps of a trellis as the recursion takes them (ALGORITHMS.md 6): for each station that one lands
//! on, where one comes from; once as time runs, and once against it.

use std::ops::Range;

/// Which way the frames of a plan are gone through.
///
/// Going on leads from each station to the next: stations are the states in their order as time
/// runs, and against their order when going back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// As time runs.
    Ahead,
    /// From the last frame to the first.
    Back,
}

impl Way {
    /// The station of a state of `n_states`, or the state of a station.
    pub fn station(self, n_states: usize, state: usize) -> usize {
        match self {
            Way::Ahead => state,
            Way::Back => n_states - 1 - state,
        }
    }

    /// What belongs to the stations of two states in a row, or to the states of two stations.
    pub fn stations_of<T>(self, [first, second]: [T; 2]) -> [T; 2] {
        match self {
            Way::Ahead => [first, second],
            Way::Back => [second, first],
        }
    }

    /// The stations of states in a row, or the states of stations.
    pub fn stations(self, n_states: usize, states: Range<usize>) -> Range<usize> {
        match self {
            Way::Ahead => states,
            Way::Back => n_states - states.end..n_states - states.start,
        }
    }
}

/// The stations landed on, those of few jumps first.
#[derive(Clone, Debug, Default)]
pub struct Landings {
    stations: Vec<u32>,
    /// The jumps to each, one station after the other.
    jumps: Vec<Origin>,
    groups: Vec<Group>,
    /// Where each station stands among those landed on; of no matter for others.
    order: Vec<u32>,
}

/// Where a jump comes from, and what it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The station left; those of one landing rise.
    pub from: u32,
    /// Turns.
    pub cost: u32,
}

/// Stations that equally many jumps lead to.
#[derive(Clone, Debug)]
struct Group {
    /// Jumps to each.
    n_jumps: usize,
    stations: Range<usize>,
    /// The first of their jumps.
    first: usize,
}

impl Landings {
    /// From jumps (landing, from, cost), sorted, between stations below `n_stations`.
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

    /// Number of stations that are landed on.
    pub fn n_landings(&self) -> usize {
        self.stations.len()
    }

    /// Number of jumps to each of some stations, the stations, and the jumps to one after the other.
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

    /// Each station landed on, and the jumps to it.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &[Origin])> {
        self.groups().flat_map(|(n_jumps, stations, jumps)| {
            let stations = stations.iter().map(|&station| station as usize);
            stations.zip(jumps.chunks(n_jumps))
        })
    }

    /// Where a station landed on stands among all of them.
    pub fn order(&self, station: usize) -> usize {
        self.order[station] as usize
    }

    /// The station that jump number `rank` to the one at `order` comes from.
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
    fn a_way_back_turns_states_around() {
        assert_eq!(Way::Back.station(10, 0), 9);
        assert_eq!(Way::Back.stations(10, 2..5), 5..8);
        assert_eq!(Way::Ahead.stations(10, 2..5), 2..5);
    }
}
