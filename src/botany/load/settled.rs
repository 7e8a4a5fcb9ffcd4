//! Reading a file that another program may be writing.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;
use std::time::{Duration, SystemTime};

use super::fault;
use crate::{Error, Result};

/// Longer than two changes of a file can have the same time: kernels stamp files by their tick, 10 ms at the most.
const TICK: Duration = Duration::from_millis(20);
/// How often a file is read before it is given up: half a second in all.
const ATTEMPTS: u32 = 25;

/// Length in bytes and time of the last change, where the file system knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct State(u64, Option<SystemTime>);

impl State {
    fn of(meta: &Metadata) -> Self {
        Self(meta.len(), meta.modified().ok())
    }

    /// Whether it may change once more without another time. Times far in the future are those of another clock and
    /// tell nothing; a little after `now` it was changed since.
    fn is_young(self, now: SystemTime) -> bool {
        let age = self
            .1
            .and_then(|time| (now + TICK).duration_since(time).ok());
        age.is_some_and(|age| age < 2 * TICK)
    }
}

/// What one try to read a file gave.
struct Reading {
    /// When it was opened.
    opened: SystemTime,
    before: State,
    bytes: Vec<u8>,
    after: State,
}

impl Reading {
    fn of(path: &Path) -> Result<Self> {
        let io = |doing| move |source| Error::io(path, doing, source);
        let mut file = File::open(path).map_err(io("open"))?;
        let opened = SystemTime::now();
        let before = State::of(&file.metadata().map_err(io("open"))?);
        let mut bytes = Vec::with_capacity(usize::try_from(before.0).unwrap_or(0));
        file.read_to_end(&mut bytes).map_err(io("read"))?;
        let after = State::of(&file.metadata().map_err(io("read"))?);
        Ok(Self {
            opened,
            before,
            bytes,
            after,
        })
    }

    /// Whether the bytes are what the file was at one moment.
    fn is_whole(&self) -> bool {
        self.before == self.after
            && self.bytes.len() as u64 == self.after.0
            && !self.before.is_young(self.opened)
    }
}

/// The bytes of a file as they were at one moment.
///
/// A file that is written in place gives the beginning of one version and the end of another, which may well be a
/// tree. So its length and time must be the same before and after, and its time old enough to tell.
///
/// # Errors
/// Says what failed, or that the file is still being written.
pub(super) fn read_settled(path: &Path) -> Result<Vec<u8>> {
    for _ in 0..ATTEMPTS {
        let reading = Reading::of(path)?;
        if reading.is_whole() {
            return Ok(reading.bytes);
        }
        std::thread::sleep(TICK);
    }
    Err(fault(
        path,
        "file",
        "it is being written while it is read",
        "wait until the program that writes it has ended",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_tells_of_changes_once_the_clock_has_gone_on() {
        let written = SystemTime::UNIX_EPOCH + Duration::from_secs(9);
        let state = State(5, Some(written));
        assert!(state.is_young(written));
        assert!(state.is_young(written + Duration::from_millis(19)));
        assert!(!state.is_young(written + Duration::from_millis(20)));
        assert!(state.is_young(written - Duration::from_millis(20)));
        assert!(
            !state.is_young(written - Duration::from_secs(3600)),
            "another clock"
        );
        assert!(!State(5, None).is_young(written), "no clock at all");
    }

    #[test]
    fn what_changed_while_it_was_read_is_no_version_of_it() {
        let written = SystemTime::UNIX_EPOCH + Duration::from_secs(9);
        let later = Some(written + Duration::from_secs(5));
        let old = State(4, Some(written));
        let whole = |before, bytes: &[u8], after, opened| {
            let bytes = bytes.to_vec();
            let reading = Reading {
                opened,
                before,
                bytes,
                after,
            };
            reading.is_whole()
        };
        let opened = written + Duration::from_secs(5);
        assert!(whole(old, b"text", old, opened));
        assert!(!whole(old, b"text", State(4, later), opened), "rewritten");
        assert!(
            !whole(old, b"text", State(7, Some(written)), opened),
            "longer"
        );
        assert!(!whole(old, b"tex", old, opened), "cut off and whole again");
        assert!(!whole(old, b"text", old, written), "within one tick");
    }

    #[test]
    fn a_file_of_this_moment_is_read_and_none_is_an_error() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("tree.glb");
        std::fs::write(&path, "text").unwrap();
        assert_eq!(read_settled(&path).unwrap(), b"text");
        let message = read_settled(home.path()).unwrap_err().to_string();
        assert!(message.contains("read"), "{message}");
    }
}
