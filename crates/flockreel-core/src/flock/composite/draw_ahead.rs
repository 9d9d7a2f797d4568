//! Drawing ahead of the consumer: frames are drawn on all threads while one more thread takes finished
//! frames in order.
//!
//! A bounded number of finished frames may wait. An encoder that starts slowly or pauses then does not
//! delay the drawing (docs/explanation/algorithms.md, "Compositing").

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use rayon::prelude::*;

use super::Shot;

/// Approximate memory for frames drawn ahead, in bytes. At least two frames per thread may wait in any
/// case. Free choice.
const AHEAD_BYTES: usize = 32 << 20;

/// Draws `n_frames` frames. `prepare` and `take` are called for the frames in order; `draw` runs on all
/// threads. `n_bytes` is the approximate size of a frame, in bytes. The first error of `prepare` or `take`
/// ends the drawing and is returned.
pub(super) fn draw_ahead<E: Send>(
    n_frames: usize,
    n_bytes: usize,
    prepare: impl FnMut(usize, &mut Shot) -> Result<(), E>,
    draw: impl Fn(usize, &mut Shot) + Sync,
    mut take: impl FnMut(usize, &Shot) -> Result<(), E> + Send,
) -> Result<(), E> {
    let n_shots = (AHEAD_BYTES / n_bytes.max(1))
        .min(64)
        .max(2 * rayon::current_num_threads());
    let (give, drawn) = channel::<Shot>();
    let (give_back, used) = channel();
    for _ in 0..n_shots {
        // Cannot fail: the receiver `used` exists.
        give_back.send(Shot::default()).ok();
    }
    thread::scope(|scope| {
        let taker = scope.spawn(move || {
            for (frame_idx, shot) in drawn.iter().enumerate() {
                take(frame_idx, &shot)?;
                // An error is ignored: without a receiver no buffer is needed.
                give_back.send(shot).ok();
            }
            Ok(())
        });
        let drawn = draw_all(n_frames, prepare, draw, &used, give);
        let taken = taker.join();
        let taken = taken.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        taken.and(drawn)
    })
}

/// Draws frames until all are drawn or the consumer has stopped.
fn draw_all<E>(
    n_frames: usize,
    mut prepare: impl FnMut(usize, &mut Shot) -> Result<(), E>,
    draw: impl Fn(usize, &mut Shot) + Sync,
    used: &Receiver<Shot>,
    give: Sender<Shot>,
) -> Result<(), E> {
    let most = rayon::current_num_threads();
    let mut first = 0;
    while first < n_frames {
        // Waits for one free buffer, then takes the others that are free. Fails when the consumer has
        // stopped.
        let Ok(shot) = used.recv() else { break };
        let n = most.min(n_frames - first);
        let mut shots: Vec<Shot> = (std::iter::once(shot).chain(used.try_iter()))
            .take(n)
            .collect();
        for (k, shot) in shots.iter_mut().enumerate() {
            prepare(first + k, shot)?;
        }
        let numbered = shots.par_iter_mut().enumerate();
        numbered.for_each(|(k, shot)| draw(first + k, shot));
        first += shots.len();
        for shot in shots {
            // An error is ignored: a consumer that has stopped returns its own error.
            give.send(shot).ok();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    use super::*;

    /// Draws 40 frames. The consumer waits at frame `at` until `wanted` frames are drawn, for one second at
    /// most. Returns the number of frames drawn at that time.
    fn drawn_when(at: usize, wanted: usize, n_bytes: usize) -> usize {
        let (n_drawn, mut seen) = (AtomicUsize::new(0), 0);
        let draw = |_, _: &mut Shot| {
            n_drawn.fetch_add(1, Ordering::SeqCst);
        };
        let count = || n_drawn.load(Ordering::SeqCst);
        let taken = draw_ahead(
            40,
            n_bytes,
            |_, _| Ok::<(), ()>(()),
            draw,
            |frame_idx, _| {
                let began = Instant::now();
                while frame_idx == at && count() < wanted && began.elapsed().as_secs() < 1 {
                    thread::sleep(Duration::from_millis(1));
                }
                if frame_idx == at {
                    seen = count();
                }
                Ok(())
            },
        );
        assert_eq!(taken, Ok(()));
        seen
    }

    #[test]
    fn frames_are_drawn_ahead_up_to_the_memory_limit() {
        assert_eq!(drawn_when(0, 40, 1 << 10), 40);
        let n_threads = rayon::current_num_threads();
        let least = 2 * n_threads;
        if least < 40 {
            assert_eq!(drawn_when(0, 40, AHEAD_BYTES), least, "{n_threads} threads");
        }
    }

    #[test]
    fn error_of_prepare_or_take_ends_the_drawing() {
        let refuse = |at: usize| move |frame_idx: usize| (frame_idx < at).then_some(()).ok_or(at);
        for (prepared, taken) in [(7, 99), (99, 7)] {
            let (prepare, take) = (refuse(prepared), refuse(taken));
            let ended = draw_ahead(
                40,
                1 << 20,
                |frame_idx, _| prepare(frame_idx),
                |_, _| {},
                |frame_idx, _| take(frame_idx),
            );
            assert_eq!(ended, Err(7));
        }
    }
}
