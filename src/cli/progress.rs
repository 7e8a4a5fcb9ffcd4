//! A bar for each stage on a terminal, nothing in a pipe; and Ctrl-C.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::error::{Error, Result};
use crate::watch::Watch;

static STOPPED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C stops work between two steps instead of ending the program at once.
///
/// # Errors
/// [`Error::Internal`] where the system refuses.
pub fn catch_ctrl_c() -> Result<()> {
    ctrlc::set_handler(|| STOPPED.store(true, Ordering::Relaxed)).map_err(|e| Error::Internal {
        step: "catch Ctrl-C",
        what: e.to_string(),
    })
}

/// Draws on standard error.
#[derive(Default)]
pub struct Bars {
    quiet: bool,
    current: Mutex<Option<ProgressBar>>,
}

impl Bars {
    /// No bar where `quiet`; nor where standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        Self {
            quiet,
            ..Self::default()
        }
    }

    /// Ends the last stage.
    pub fn finish(&self) {
        self.replace(None);
    }

    fn replace(&self, next: Option<ProgressBar>) {
        let mut current = self.current.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(bar) = std::mem::replace(&mut *current, next) {
            bar.set_position(bar.length().unwrap_or(0));
            bar.set_message("");
            bar.finish();
        }
    }
}

impl Watch for Bars {
    fn stage(&self, name: &str, steps: u64) {
        if self.quiet {
            return;
        }
        let style =
            ProgressStyle::with_template("{prefix:>12} {bar:24} {pos}/{len}  {elapsed}  {msg}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
        bar.set_style(style);
        bar.set_prefix(name.to_string());
        bar.enable_steady_tick(Duration::from_millis(200));
        self.replace(Some(bar));
    }

    fn part(&self, name: &str) {
        let current = self.current.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(bar) = &*current {
            bar.set_message(name.to_string());
        }
    }

    fn step(&self) {
        let current = self.current.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(bar) = &*current {
            bar.inc(1);
        }
    }

    fn stopped(&self) -> bool {
        STOPPED.load(Ordering::Relaxed)
    }
}
