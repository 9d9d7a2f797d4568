//! Metrics of jobs for `/metrics`: outcomes, duration of each stage, and speed of decoding. All labels have a
//! fixed set of values (kinds, stages, outcomes, codes) and never contain ids.

use std::sync::Arc;
use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

use super::listener::Listener;
use super::worker::Step;
use crate::store::jobs::Kind;
use crate::store::upkeep::retention::Retired;

/// Upper limits of the histogram buckets for stages, seconds. They cover short and long videos.
const JOB_S: [f64; 11] = [
    0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 180.0, 600.0, 1800.0, 3600.0,
];
/// Upper limits of the histogram buckets for decoding, frames per second. They cover large videos on a busy
/// machine and small ones on an idle machine.
const DECODE_FPS: [f64; 9] = [5.0, 15.0, 30.0, 60.0, 120.0, 250.0, 500.0, 1000.0, 2000.0];

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Ended {
    kind: &'static str,
    outcome: &'static str,
    code: &'static str,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Noun {
    noun: &'static str,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Stage {
    kind: &'static str,
    stage: &'static str,
}

type Times = Family<Stage, Histogram, fn() -> Histogram>;

/// The metrics of one process. Clones are cheap and share the counters.
#[derive(Clone)]
pub struct Meters {
    ended: Family<Ended, Counter>,
    stages: Times,
    decoded: Counter,
    decode_fps: Arc<Histogram>,
    retired: Family<Noun, Counter>,
}

impl Default for Meters {
    fn default() -> Meters {
        Meters {
            ended: Family::default(),
            stages: Family::new_with_constructor(|| Histogram::new(JOB_S)),
            decoded: Counter::default(),
            decode_fps: Arc::new(Histogram::new(DECODE_FPS)),
            retired: Family::default(),
        }
    }
}

impl Meters {
    /// Adds the metrics to a registry.
    pub fn register(&self, registry: &mut Registry) {
        registry.register(
            "flockreel_job_attempts",
            "Attempts of jobs, by outcome",
            self.ended.clone(),
        );
        registry.register(
            "flockreel_job_stage_seconds",
            "Duration of each stage of an attempt",
            self.stages.clone(),
        );
        registry.register(
            "flockreel_decoded_frames",
            "Frames decoded for analyses",
            self.decoded.clone(),
        );
        registry.register(
            "flockreel_decode_frames_per_second",
            "Decoding rate of the films of analyses",
            (*self.decode_fps).clone(),
        );
        registry.register(
            "flockreel_retention_deletes",
            "Resources and jobs deleted because of their age",
            self.retired.clone(),
        );
    }

    /// Counts data that was deleted because of its age.
    pub(super) fn count_retired(&self, retired: &Retired) {
        let resources = retired.resources.iter();
        let counts = resources.map(|(kind, amount)| (kind.plural(), amount.n.unsigned_abs()));
        for (noun, n) in counts.chain([("jobs", retired.n_jobs)]) {
            self.retired.get_or_create(&Noun { noun }).inc_by(n);
        }
    }

    /// Counts a completed attempt.
    pub(super) fn count(&self, kind: Kind, step: &Step, listener: &Listener) {
        let (outcome, code) = match step {
            Step::Idle => return,
            Step::Done(_) => ("done", ""),
            Step::Failed(_, code) => ("failed", code.name()),
            Step::Retried(_) => ("retried", ""),
            Step::Cancelled(_) => ("cancelled", ""),
            Step::Released(_) => ("released", ""),
            Step::Lost(_) => ("lost", ""),
        };
        let kind = kind.name();
        let ended = Ended {
            kind,
            outcome,
            code,
        };
        self.ended.get_or_create(&ended).inc();
        for (stage, took) in listener.stage_times() {
            let times = self.stages.get_or_create(&Stage { kind, stage });
            times.observe(took.as_secs_f64());
        }
        let (n_frames, took) = listener.decoded();
        self.decoded.inc_by(n_frames);
        if n_frames > 0 && took > Duration::ZERO {
            self.decode_fps
                .observe(n_frames as f64 / took.as_secs_f64());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flockreel_core::code::Code;
    use flockreel_core::ids::JobId;

    #[test]
    fn attempt_is_counted_with_its_stages_and_frames() {
        let (meters, mut registry) = (Meters::default(), Registry::default());
        meters.register(&mut registry);
        let listener = Listener::new(&[("tracking", 1.0)]);
        listener.report("tracking", 0.5);
        listener.count_decoded(50, Duration::from_millis(500));
        let failed = Step::Failed(JobId(uuid::Uuid::nil()), Code::NothingMoves);
        meters.count(Kind::Analysis, &failed, &listener);
        let mut text = String::new();
        prometheus_client::encoding::text::encode(&mut text, &registry).unwrap();
        for line in [
            "flockreel_job_attempts_total{kind=\"analysis\",outcome=\"failed\",code=\"nothing_moves\"} 1\n",
            "flockreel_job_stage_seconds_count{kind=\"analysis\",stage=\"tracking\"} 1\n",
            "flockreel_decoded_frames_total 50\n",
            "flockreel_decode_frames_per_second_sum 100.0\n",
        ] {
            assert!(text.contains(line), "{line}{text}");
        }
    }
}
