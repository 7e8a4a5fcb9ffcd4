//! Repaired or ignored trouble, counted by kind.

/// Collects warnings; each kind is said once, with its count and the first place.
#[derive(Default)]
pub(super) struct Warnings {
    kinds: Vec<(String, u64, String)>,
}

impl Warnings {
    /// Notes one more case of `what`, met at `place`.
    pub fn say(&mut self, what: &str, place: &str) {
        self.count(what, 1, place);
    }

    /// Notes `n` more cases of `what`; none if `n` is zero.
    pub fn count(&mut self, what: &str, n: u64, place: &str) {
        if n == 0 {
            return;
        }
        match self.kinds.iter_mut().find(|kind| kind.0 == what) {
            Some(kind) => kind.1 += n,
            None => self.kinds.push((what.into(), n, place.into())),
        }
    }

    /// One line a kind, in the order of first occurrence.
    pub fn into_lines(self) -> Vec<String> {
        let line = |(what, n, place): (String, u64, String)| match (n, place.is_empty()) {
            (1, true) => what,
            (1, false) => format!("{what} ({place})"),
            (n, true) => format!("{what} ({n} times)"),
            (n, false) => format!("{what} ({n} times, first: {place})"),
        };
        self.kinds.into_iter().map(line).collect()
    }
}
