//! `stats` of flock.json: quality of the flock, and order of its boids on average and in every frame.

use serde::{Deserialize, Serialize};

use crate::flock::{Order, Stats};

/// `stats` of flock.json.
#[derive(Serialize, Deserialize)]
pub(super) struct StatsFile {
    #[serde(flatten, with = "StatsFields")]
    pub(super) stats: Stats,
    /// Absent in older files; then empty.
    #[serde(default)]
    per_frame: OrdersFile,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Stats")]
struct StatsFields {
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
    /// This field and the following ones are absent in older files; then 0.
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
    clipped_share: f64,
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
    pub(super) fn new(stats: Stats, orders: &[Order]) -> StatsFile {
        StatsFile {
            stats,
            per_frame: OrdersFile::new(orders),
        }
    }

    /// Returns the order of every frame. Fails if the lists differ in length.
    pub(super) fn orders(&self) -> Result<Vec<Order>, serde_json::Error> {
        self.per_frame.orders()
    }
}

impl OrdersFile {
    fn new(orders: &[Order]) -> OrdersFile {
        fn each<T>(orders: &[Order], value: impl Fn(&Order) -> T) -> Vec<T> {
            orders.iter().map(value).collect()
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
