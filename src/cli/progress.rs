//! What a person at a terminal sees of a computation: a bar on a terminal, plain lines otherwise
//! (DESIGN.md: progress goes to stderr). One listener serves every command.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressStyle};

use crate::progress::Progress;

/// A plain line is written when a stage begins and each time another quarter of it is done.
const PLAIN_STEPS: f64 = 4.0;
const TICKS: u64 = 1000;

/// Shows stage and fraction on stderr.
pub struct Listener {
    /// The bar, when stderr is a terminal.
    bar: Option<ProgressBar>,
    /// Stage and last step written, for plain lines and for the bar's label.
    last: Mutex<(&'static str, u32)>,
}

impl Listener {
    /// A bar when stderr is a terminal, plain lines otherwise.
    pub fn new() -> Listener {
        let bar = std::io::stderr().is_terminal().then(|| {
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
        let fresh_stage = last.0 != stage;
        let fresh_step = fresh_stage || last.1 < step;
        *last = (stage, if fresh_stage { step } else { last.1.max(step) });
        match &self.bar {
            Some(bar) => {
                if fresh_stage {
                    bar.set_message(stage);
                }
                bar.set_position((fraction * TICKS as f64) as u64);
            }
            None if fresh_step => {
                let percent = (fraction * 100.0).round();
                // A closed stderr must not stop the work.
                writeln!(std::io::stderr(), "{stage}: {percent}%").ok();
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
