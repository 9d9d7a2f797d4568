//! Measures the time of a boid simulation step, for `bench/boids.py` (docs/explanation/algorithms.md, "Boids"
//! and "Quality measures").
//!
//! Arguments: COUNT STEPS. Simulates a school in a flat tank, on one thread and on all. Prints one line of
//! JSON with the seconds per step.

mod timing;

use flockreel_core::flock::Params;
use flockreel_core::flock::boids::Boids;
use flockreel_core::flock::boids::calibration::Calibration;
use flockreel_core::flock::boids::tank::Tank;
use flockreel_core::flock::lens::Lens;

/// Area of the tank per boid, square body lengths.
const AREA_PER_BOID_BL2: f64 = 1.5;

fn main() {
    let arguments: Vec<String> = timing::arguments().collect();
    let [count, steps] = &arguments[..] else {
        // `cargo test --benches` runs this program without arguments.
        return println!("arguments: COUNT STEPS");
    };
    let count: u32 = count.parse().expect("a number");
    let steps: u32 = steps.parse().expect("a number");
    let n_threads = rayon::current_num_threads();
    let (one, all) = (time(count, steps, 1), time(count, steps, n_threads));
    println!(
        "{{\"count\":{count},\"steps\":{steps},\"one_thread_s\":{one:.6},\"threads\":{n_threads},\
         \"all_threads_s\":{all:.6}}}"
    );
}

/// Returns the seconds per step: the fastest of three runs of `steps` steps.
fn time(count: u32, steps: u32, n_threads: usize) -> f64 {
    let params = Params {
        count: Some(count),
        leaders: false,
        ..Params::default()
    };
    let calibration = Calibration {
        turn_rad_per_s: 3.0,
        wander_rad_per_s: 1.5,
        ..Calibration::default()
    };
    let side = (f64::from(count) * AREA_PER_BOID_BL2).sqrt();
    let (lens, tank) = (Lens::flat(40.0), Tank::new([0.0; 3], [side, side, 0.0]));
    timing::on_threads(n_threads, || {
        let mut boids = Boids::at_random(&params, &calibration, &lens, &tank, 30.0);
        let seconds = timing::fastest_s(3, || (0..steps).for_each(|_| boids.advance()));
        seconds / f64::from(steps)
    })
}
