//! Where time and memory go, stage by stage.

use std::sync::Mutex;
use std::time::Instant;

use super::Watch;
use crate::report::schema::Stage;

/// Times the stages and parts of a bake for `inner`, who watches too.
pub struct Clock<W> {
    inner: W,
    times: Mutex<Times>,
}

struct Times {
    /// Every stage and part in order of its first appearance.
    rows: Vec<Stage>,
    since: Instant,
    cpu_since: f64,
    current: usize,
}

impl<W> Clock<W> {
    /// Starts.
    pub fn new(inner: W) -> Self {
        Self {
            inner,
            times: Mutex::new(Times {
                rows: vec![row("start")],
                since: Instant::now(),
                cpu_since: cpu_seconds(),
                current: 0,
            }),
        }
    }

    /// Who watches too.
    pub fn inner(&self) -> &W {
        &self.inner
    }

    /// Stops; every stage that took any time.
    pub fn finish(&self) -> Vec<Stage> {
        self.enter("end");
        let times = self.times.lock().unwrap_or_else(|e| e.into_inner());
        let spent = times.rows.iter().filter(|row| row.seconds > 0.0);
        spent.cloned().collect()
    }

    fn enter(&self, name: &str) {
        let mut times = self.times.lock().unwrap_or_else(|e| e.into_inner());
        let times = &mut *times;
        let (now, cpu) = (Instant::now(), cpu_seconds());
        let row_before = &mut times.rows[times.current];
        row_before.seconds += (now - times.since).as_secs_f64();
        row_before.cpu_seconds += cpu - times.cpu_since;
        row_before.peak_bytes = row_before.peak_bytes.max(peak_bytes().unwrap_or(0));
        (times.since, times.cpu_since) = (now, cpu);
        // Later stages show their own peak, where the system lets it be reset.
        let _ = std::fs::write("/proc/self/clear_refs", "5");
        let known = times.rows.iter().position(|r| r.name == name);
        times.current = known.unwrap_or(times.rows.len());
        if known.is_none() {
            times.rows.push(row(name));
        }
    }
}

fn row(name: &str) -> Stage {
    Stage {
        name: name.into(),
        ..Stage::default()
    }
}

impl<W: Watch> Watch for Clock<W> {
    fn stage(&self, name: &str, steps: u64) {
        self.enter(name);
        self.inner.stage(name, steps);
    }

    fn part(&self, name: &str) {
        self.enter(name);
        self.inner.part(name);
    }

    fn step(&self) {
        self.inner.step();
    }

    fn stopped(&self) -> bool {
        self.inner.stopped()
    }
}

/// Processor time of all threads so far, seconds; 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The second field is the program's name in brackets, and may hold anything.
    let fields = stat.rsplit_once(')').map_or("", |(_, fields)| fields);
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks: f64 = ticks.filter_map(|f| f.parse::<f64>().ok()).sum();
    // Linux counts in hundredths of a second here, whatever the kernel's own clock.
    ticks / 100.0
}

/// Largest resident memory of the process, bytes, since it was last reset; `None` where the system
/// does not tell.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Unwatched;

    #[test]
    fn stages_that_come_again_are_summed_in_order_of_appearance() {
        let clock = Clock::new(Unwatched);
        for name in ["load", "fit", "load"] {
            clock.stage(name, 1);
            std::thread::sleep(std::time::Duration::from_millis(3));
        }
        let stages = clock.finish();
        let names: Vec<&str> = stages.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["start", "load", "fit"]);
        // Sleeping takes no less; how much more is the machine's affair.
        assert!(stages[1].seconds >= 0.006 && stages[2].seconds >= 0.003);
    }
}
