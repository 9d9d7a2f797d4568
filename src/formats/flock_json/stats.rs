//! `stats` of flock.json: quality of the flock, and order of its boids on average and in every frame.

use serde::{Deserialize, Serialize};

use crate::flock::{Order, Stats};

#[derive(Serialize, Deserialize)]
pub(super) struct StatsFile {
    heading_error_median_rad: f64,
    heading_error_p90_rad: f64,
    jumps_per_100_frames: f64,
    /// Absent in older files; then 0.
    #[serde(default)]
    repeats_per_100_frames: f64,
    path_deviation_p95_bl: f64,
    slip_median_rad: f64,
    clone_share: f64,
    /// Absent in older files; then 0.
    #[serde(default)]
    distinct_looks: u32,
    /// Absent in older files; then 0.
    #[serde(default)]
    room_for: u32,
    variety: f64,
    polarization: f64,
    milling: f64,
    nearest_neighbor_bl: f64,
    /// This field and the following ones are absent in older files; then 0 or empty.
    #[serde(default)]
    spacing_bl: f64,
    #[serde(default)]
    crossings_per_min: f64,
    #[serde(default)]
    visible_share: f64,
    #[serde(default)]
    neighbor_share: f64,
    #[serde(default)]
    groups: f64,
    #[serde(default)]
    overlap_bl: f64,
    #[serde(default)]
    wall_violations: u64,
    #[serde(default)]
    overlap_violations: u64,
    #[serde(default)]
    per_frame: OrdersFile,
}

/// The order of every frame, one list per measure.
#[derive(Default, Serialize, Deserialize)]
struct OrdersFile {
    polarization: Vec<f64>,
    milling: Vec<f64>,
    nearest_neighbor_bl: Vec<f64>,
    neighbor_share: Vec<f64>,
    groups: Vec<u32>,
    wall_violations: Vec<u32>,
    overlap_violations: Vec<u32>,
}

impl StatsFile {
    pub(super) fn of(stats: &Stats, orders: &[Order]) -> StatsFile {
        StatsFile {
            heading_error_median_rad: stats.heading_error_median_rad,
            heading_error_p90_rad: stats.heading_error_p90_rad,
            jumps_per_100_frames: stats.jumps_per_100_frames,
            repeats_per_100_frames: stats.repeats_per_100_frames,
            path_deviation_p95_bl: stats.path_deviation_p95_bl,
            slip_median_rad: stats.slip_median_rad,
            clone_share: stats.clone_share,
            distinct_looks: stats.distinct_looks,
            room_for: stats.room_for,
            variety: stats.variety,
            polarization: stats.polarization,
            milling: stats.milling,
            nearest_neighbor_bl: stats.nearest_neighbor_bl,
            spacing_bl: stats.spacing_bl,
            crossings_per_min: stats.crossings_per_min,
            visible_share: stats.visible_share,
            neighbor_share: stats.neighbor_share,
            groups: stats.groups,
            overlap_bl: stats.overlap_bl,
            wall_violations: stats.wall_violations,
            overlap_violations: stats.overlap_violations,
            per_frame: OrdersFile::of(orders),
        }
    }

    /// Returns the order of every frame. Fails if the lists differ in length.
    pub(super) fn orders(&self) -> Result<Vec<Order>, serde_json::Error> {
        self.per_frame.orders()
    }

    pub(super) fn into_stats(self) -> Stats {
        Stats {
            heading_error_median_rad: self.heading_error_median_rad,
            heading_error_p90_rad: self.heading_error_p90_rad,
            jumps_per_100_frames: self.jumps_per_100_frames,
            repeats_per_100_frames: self.repeats_per_100_frames,
            path_deviation_p95_bl: self.path_deviation_p95_bl,
            slip_median_rad: self.slip_median_rad,
            clone_share: self.clone_share,
            distinct_looks: self.distinct_looks,
            room_for: self.room_for,
            variety: self.variety,
            polarization: self.polarization,
            milling: self.milling,
            nearest_neighbor_bl: self.nearest_neighbor_bl,
            spacing_bl: self.spacing_bl,
            crossings_per_min: self.crossings_per_min,
            visible_share: self.visible_share,
            neighbor_share: self.neighbor_share,
            groups: self.groups,
            overlap_bl: self.overlap_bl,
            wall_violations: self.wall_violations,
            overlap_violations: self.overlap_violations,
        }
    }
}

impl OrdersFile {
    fn of(orders: &[Order]) -> OrdersFile {
        fn each<T>(orders: &[Order], of: impl Fn(&Order) -> T) -> Vec<T> {
            orders.iter().map(of).collect()
        }
        OrdersFile {
            polarization: each(orders, |order| order.polarization),
            milling: each(orders, |order| order.milling),
            nearest_neighbor_bl: each(orders, |order| order.nearest_bl),
            neighbor_share: each(orders, |order| order.neighbor_share),
            groups: each(orders, |order| order.n_groups),
            wall_violations: each(orders, |order| order.n_outside),
            overlap_violations: each(orders, |order| order.n_overlaps),
        }
    }

    fn orders(&self) -> Result<Vec<Order>, serde_json::Error> {
        let n_frames = self.polarization.len();
        let lengths = [
            self.milling.len(),
            self.nearest_neighbor_bl.len(),
            self.neighbor_share.len(),
            self.groups.len(),
            self.wall_violations.len(),
            self.overlap_violations.len(),
        ];
        if lengths.iter().any(|&length| length != n_frames) {
            let why = "stats.per_frame: the measures have different numbers of frames";
            return Err(serde::de::Error::custom(why));
        }
        let order = |t: usize| Order {
            polarization: self.polarization[t],
            milling: self.milling[t],
            nearest_bl: self.nearest_neighbor_bl[t],
            neighbor_share: self.neighbor_share[t],
            n_groups: self.groups[t],
            n_outside: self.wall_violations[t],
            n_overlaps: self.overlap_violations[t],
        };
        Ok((0..n_frames).map(order).collect())
    }
}
