//! Progress of a command on stderr: a bar on a terminal, plain lines otherwise. All commands share this
//! module.

use std::io::IsTerminal;
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};

use crate::logging::{self, say};
use flockreel_core::progress::Progress;

/// Number of steps of a stage. A plain line is written at its start and after each step. Free choice.
const PLAIN_STEPS: f64 = 4.0;
/// Number of positions of the bar. Free choice.
const TICKS: u64 = 1000;

/// Shows the stage and its progress on stderr.
pub struct Listener {
    /// The bar; `None` if stderr is no terminal.
    bar: Option<ProgressBar>,
    /// The last stage and step shown.
    last: Mutex<(&'static str, u32)>,
}

impl Listener {
    /// Returns a listener that shows a bar if stderr is a terminal for people, else plain lines.
    pub fn new() -> Listener {
        let has_bar = std::io::stderr().is_terminal() && !logging::is_json();
        let bar = has_bar.then(|| {
            let bar = ProgressBar::new(TICKS);
            let template = "{msg:>12} [{bar:32}] {percent:>3}% {elapsed}";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style.progress_chars("=> "));
            }
            bar
        });
        Listener {
            bar,
            last: Mutex::new(("", 0)),
        }
    }
}

impl Default for Listener {
    fn default() -> Listener {
        Listener::new()
    }
}

impl Progress for Listener {
    fn report(&self, stage: &'static str, fraction: f64) {
        let fraction = fraction.clamp(0.0, 1.0);
        let step = (fraction * PLAIN_STEPS) as u32;
        let Ok(mut last) = self.last.lock() else {
            return;
        };
        let is_new_stage = last.0 != stage;
        let is_new_step = is_new_stage || last.1 < step;
        *last = (stage, if is_new_stage { step } else { last.1.max(step) });
        match &self.bar {
            Some(bar) => {
                if is_new_stage {
                    bar.set_message(stage);
                }
                bar.set_position((fraction * TICKS as f64) as u64);
            }
            None if is_new_step => {
                let percent = (fraction * 100.0).round();
                say(&format!("{stage}: {percent}%"));
            }
            None => {}
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
