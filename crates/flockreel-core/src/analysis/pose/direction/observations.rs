//! The measurements in the form that the estimate uses: from the first detection to the last, with
//! interpolated centroids in the gaps.

use super::Measurement;
use super::body::BodyAxes;
use super::state::State;
use crate::geometry::Camera;

/// Longest gap between detections that is interpolated, seconds. Free choice.
const BRIDGE_S: f64 = 0.5;
/// Smallest number of uncut silhouettes. One second of them is needed too. Free choice.
const MIN_SILHOUETTES: usize = 8;

/// Second moments xx, xy and yy of one pixel, which is a square, in square pixels.
pub(super) const PIXEL_MOMENTS_PX2: [f64; 3] = [1.0 / 12.0, 0.0, 1.0 / 12.0];

/// The observations of a footage.
pub(super) struct Observations {
    /// Frame number in the footage of `frames[0]`.
    pub(super) first: usize,
    pub(super) frames: Vec<Observation>,
    /// True for frames with a detection and for frames in a gap of at most `BRIDGE_S`.
    pub(super) bridged: Vec<bool>,
    /// Time between frames, seconds.
    pub(super) dt: f64,
    pub(super) focal_px: f64,
    pub(super) medium_index: f64,
}

/// The observation of one frame.
#[derive(Clone, Copy, Default)]
pub(super) struct Observation {
    /// Slope of the line of sight to the centroid: (centroid - image center) / focal length.
    pub(super) slope: [f64; 2],
    pub(super) detected: bool,
    /// Unit vector in the image toward the head, from the user.
    pub(super) given_head: Option<[f64; 2]>,
    /// Evidence for the head's side, as in [`Measurement::head_evidence`].
    pub(super) head_evidence: Option<[f64; 2]>,
    /// `None` without a detection or where the image border cuts the silhouette.
    pub(super) silhouette: Option<Silhouette>,
}

/// The measurements of an uncut silhouette.
#[derive(Clone, Copy)]
pub(super) struct Silhouette {
    /// Second central moments xx, xy and yy, square pixels.
    pub(super) covariance_px2: [f64; 3],
    /// Vertical extent, pixels.
    pub(super) vertical_px: f64,
}

impl Silhouette {
    /// Returns the standard deviations of the measured moments xx, xy and yy, square pixels.
    pub(super) fn moment_noise_px2(&self) -> [f64; 3] {
        let [xx, _, yy] = self.covariance_px2;
        let mean = (xx * yy).max(1.0).sqrt();
        [
            0.05 * xx + 0.03 * mean,
            0.06 * mean,
            0.05 * yy + 0.01 * mean,
        ]
    }
}

impl Observation {
    fn new(measurement: &Measurement, slope: [f64; 2]) -> Observation {
        let is_whole = !measurement.cut
            && measurement.vertical_px > 0.0
            && measurement.covariance_px2[0] > 0.0;
        let unit = |[x, y]: [f64; 2]| {
            let length = libm::hypot(x, y);
            (length > 0.0).then(|| [x / length, y / length])
        };
        Observation {
            slope,
            detected: true,
            given_head: measurement.given_head_px.and_then(unit),
            head_evidence: measurement.head_evidence.filter(|_| is_whole),
            silhouette: is_whole.then_some(Silhouette {
                covariance_px2: measurement.covariance_px2,
                vertical_px: measurement.vertical_px,
            }),
        }
    }
}

impl Observations {
    /// Returns the observations, or `None` if too few silhouettes are uncut.
    pub(super) fn new(
        measured: &[Option<Measurement>],
        camera: &Camera,
        fps: f64,
    ) -> Option<Observations> {
        let first = measured.iter().position(Option::is_some)?;
        let focal_px = camera.focal_px();
        let mut frames: Vec<Observation> = Vec::new();
        let mut bridged = Vec::new();
        let mut last_detected = first;
        for (k, measurement) in measured.iter().enumerate() {
            let Some(measurement) = measurement else {
                continue;
            };
            let slope =
                [0, 1].map(|c| (measurement.centroid_px[c] - camera.center_px[c]) / focal_px);
            if let Some(from) = frames.last().map(|frame| frame.slope) {
                let n_steps = k - last_detected;
                for step in 1..n_steps {
                    let share = step as f64 / n_steps as f64;
                    frames.push(Observation {
                        slope: [0, 1].map(|c| from[c] + (slope[c] - from[c]) * share),
                        ..Observation::default()
                    });
                    bridged.push((n_steps - 1) as f64 <= BRIDGE_S * fps);
                }
            }
            last_detected = k;
            frames.push(Observation::new(measurement, slope));
            bridged.push(true);
        }
        let n_whole = frames.iter().filter(|f| f.silhouette.is_some()).count();
        (n_whole as f64 >= fps && n_whole >= MIN_SILHOUETTES).then_some(Observations {
            first,
            frames,
            bridged,
            dt: 1.0 / fps,
            focal_px,
            medium_index: camera.medium_index,
        })
    }

    /// Returns the weight of one frame, 0..=1. Above 30 frames a second, neighboring frames are not
    /// independent: all frames of one second together weigh at most 30.
    pub(super) fn frame_weight(&self) -> f64 {
        (30.0 * self.dt).min(1.0)
    }

    /// Returns the projection of body axes into the image at the centroid of an observation.
    pub(super) fn project(&self, axes: &BodyAxes, observation: &Observation) -> [[f64; 3]; 2] {
        axes.projected(observation.slope, 1.0 / self.medium_index)
    }

    /// Returns the factor from square metres at the depth of a state to square pixels.
    pub(super) fn px2_per_m2(&self, state: &State) -> f64 {
        (self.focal_px * libm::exp(-state.log_z)).powi(2)
    }
}
