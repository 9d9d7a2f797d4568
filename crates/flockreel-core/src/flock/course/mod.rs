//! Simulation of a flock frame by frame, recorded as in files: straight through, or as a loop
//! (docs/explanation/algorithms.md, "Boids").

mod detours;
mod seam;

use self::detours::{Limits, avoid_encounters};
use self::seam::Snapshot;
use super::boids::Boids;
use super::boids::measures::Order;
use super::boids::vector::{Vec3, unit};
use super::error::Error;
use super::individual::BoidTrack;
use super::lens::Lens;
use crate::geometry::{Turns, rounded};
use crate::progress::Progress;

/// A recorded simulation.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// Tracks of the boids, by id.
    pub(super) tracks: Vec<BoidTrack>,
    /// Collective order, by frame.
    pub(super) orders: Vec<Order>,
    /// Position of the predator, by frame. Empty without a predator.
    pub(super) predator_px: Vec<[f64; 3]>,
    /// In a loop, the id of the individual as which each one continues after the last frame. `None` outside
    /// loops.
    pub(super) continuations: Option<Vec<u32>>,
}

/// Lets the boids form a flock, then simulates `n_frames` frames. Fails if the job is cancelled.
pub(super) fn simulate(
    mut boids: Boids,
    lens: &Lens,
    n_frames: u32,
    progress: &dyn Progress,
) -> Result<Course, Error> {
    let mut step = steps(boids.n_warm_up_frames() + n_frames as usize, progress);
    boids.form(&mut step)?;
    let mut course = Course::new(&boids, lens);
    for t in 0..n_frames {
        step()?;
        if t > 0 {
            boids.advance();
        }
        course.record(&boids, lens);
    }
    Ok(course)
}

/// Simulates a loop of `n_frames` frames, whose last frame leads into the first (`seam`). Fails if the job is
/// cancelled.
pub(super) fn simulate_loop(
    mut boids: Boids,
    lens: &Lens,
    n_frames: u32,
    fps: f64,
    progress: &dyn Progress,
) -> Result<Course, Error> {
    let n_lead = seam::n_meeting_frames(n_frames, fps);
    let n_frames = n_frames as usize;
    let mut step = steps(boids.n_warm_up_frames() + n_lead + n_frames, progress);
    boids.form(&mut step)?;
    boids.delay_start(n_lead);
    let mut lead = Vec::with_capacity(n_lead);
    for _ in 0..n_lead {
        step()?;
        lead.push(Snapshot::new(&boids));
        boids.advance();
    }
    let mut continuations = Vec::new();
    let mut snapshots = Vec::with_capacity(n_frames);
    for t in 0..n_frames {
        step()?;
        snapshots.push(Snapshot::new(&boids));
        let left = n_frames - t;
        if left == n_lead {
            continuations = seam::continuations(&snapshots[t], &lead);
        }
        if left <= n_lead {
            boids.steer_toward(seam::meeting(&lead, &continuations, left));
        }
        boids.advance();
    }
    seam::blend_into_lead(&mut snapshots, &lead, &continuations, fps);
    let limits = Limits {
        apart_bl: boids.overlap_bl(),
        fastest_bl_per_s: boids.max_speed_bl_per_s(),
        fps,
    };
    avoid_encounters(&mut snapshots, limits, |place| boids.confined(place));
    let mut course = Course::new(&boids, lens);
    for snapshot in snapshots {
        boids.set_states(snapshot.positions, snapshot.velocities, snapshot.predator);
        course.record(&boids, lens);
    }
    course.continuations = Some(continuations);
    Ok(course)
}

/// Returns a function to call before each frame. It reports progress, and fails if the job is cancelled.
/// `n_frames` is the expected number of calls; more are allowed.
pub(super) fn steps(n_frames: usize, progress: &dyn Progress) -> impl FnMut() -> Result<(), Error> {
    let mut gone = 0;
    move || {
        if progress.cancelled() {
            return Err(Error::Cancelled);
        }
        progress.report("simulating", f64::min(1.0, gone as f64 / n_frames as f64));
        gone += 1;
        Ok(())
    }
}

impl Course {
    pub(super) fn new(boids: &Boids, lens: &Lens) -> Course {
        let track = BoidTrack {
            forward: (!lens.is_flat()).then(Vec::new),
            ..BoidTrack::default()
        };
        Course {
            tracks: vec![track; boids.positions().len()],
            orders: Vec::new(),
            predator_px: Vec::new(),
            continuations: None,
        }
    }

    pub(super) fn record(&mut self, boids: &Boids, lens: &Lens) {
        for (id, track) in self.tracks.iter_mut().enumerate() {
            record(track, lens, boids, id);
        }
        let predator = boids
            .predator()
            .map(|place| picture_position(place, lens, boids));
        self.predator_px.extend(predator);
        self.orders.push(rounded_order(boids.order()));
    }

    /// Appends a later simulation.
    pub(super) fn append(&mut self, later: Course) {
        for (track, later) in self.tracks.iter_mut().zip(later.tracks) {
            track.append(later);
        }
        self.orders.extend(later.orders);
        self.predator_px.extend(later.predator_px);
    }
}

/// Returns the order, rounded as in files.
fn rounded_order(order: Order) -> Order {
    let r = |value| rounded(value, 4);
    Order {
        polarization: r(order.polarization),
        milling: r(order.milling),
        nearest_bl: r(order.nearest_bl),
        neighbor_share: r(order.neighbor_share),
        ..order
    }
}

/// Returns the position in the image and the distance behind the front of the tank, pixels.
fn picture_position(place: Vec3, lens: &Lens, boids: &Boids) -> [f64; 3] {
    let [x, y] = lens.picture_px(place);
    let behind_px = (place[2] - boids.front_bl()) * lens.length_px;
    [x, y, behind_px].map(|px| rounded(px, 2))
}

/// Appends the current position, direction and speed of a boid to its track.
fn record(track: &mut BoidTrack, lens: &Lens, boids: &Boids, id: usize) {
    let (place, velocity) = (boids.positions()[id], boids.actual_velocity(id));
    track.position_px.push(picture_position(place, lens, boids));
    if let Some(forward) = &mut track.forward {
        forward.push(unit(boids.velocities()[id]).map(|part| rounded(part, 5)));
    }
    let [vx, vy] = lens.picture_velocity(place, velocity);
    let [x, y] = lens.picture_velocity(place, boids.velocities()[id]);
    let heading = Turns::from_rad(libm::atan2(y, x));
    track.heading_rad.push(rounded(heading.to_rad(), 5));
    track.speed_bl_per_s.push(rounded(vx.hypot(vy), 3));
}
