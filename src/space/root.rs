//! Where a falling function crosses zero, with few evaluations: each may draw a whole scene.

/// The search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Where the answer lies; its ends are the answer where the function doesn't cross zero.
    pub range: [f64; 2],
    /// First value tried.
    pub guess: f64,
    /// How steeply the function may fall: tells where the second value is tried.
    pub slope: f64,
    /// Most distance from the guess to the second value tried; it may double until zero is passed.
    pub step: f64,
    /// The answer is known well enough when it is this certain.
    pub grain: f64,
    /// Values of the function as small as this count as zero.
    pub tolerance: f64,
}

/// Zero is passed by this much more than a line says, so that it lies between two values.
const FARTHER: f64 = 1.25;

impl Search {
    /// The crossing of `f`, which must not rise, by the Illinois variant of false position.
    pub fn falling(self, mut f: impl FnMut(f64) -> f64) -> f64 {
        let [least, most] = self.range;
        let first = self.guess.clamp(least, most);
        let value = f(first);
        if value.abs() <= self.tolerance {
            return first;
        }
        let (mut low, mut high) = ((first, value), (first, value));
        let (mut step, mut last) = (self.step.min(value.abs() / self.slope), value);
        // Walk towards zero until it is passed.
        while (low.1 > 0.0) == (high.1 > 0.0) {
            let up = value > 0.0;
            let from = if up { high.0 } else { low.0 };
            step = step.max(self.grain);
            let next = (from + if up { step } else { -step }).clamp(least, most);
            if next == from {
                return next;
            }
            let value = f(next);
            if value.abs() <= self.tolerance {
                return next;
            }
            (low, high) = if up {
                (high, (next, value))
            } else {
                ((next, value), low)
            };
            // On along the last two values, and a little farther than to zero; flat ones tell nothing.
            let fell = (last - value).abs() / step;
            step = (2.0 * step).min(FARTHER * value.abs() / fell.max(f64::MIN_POSITIVE));
            last = value;
        }
        self.narrow(low, high, f)
    }

    fn narrow(
        self,
        mut low: (f64, f64),
        mut high: (f64, f64),
        mut f: impl FnMut(f64) -> f64,
    ) -> f64 {
        // An end that stays twice counts half: otherwise curved functions approach from one side.
        let mut kept = 0i32;
        while high.0 - low.0 > self.grain {
            let share = (low.1 / (low.1 - high.1)).clamp(0.05, 0.95);
            let x = low.0 + (high.0 - low.0) * share;
            let value = f(x);
            if value.abs() <= self.tolerance {
                return x;
            }
            if value > 0.0 {
                low = (x, value);
                kept = kept.max(0) + 1;
                high.1 *= if kept > 1 { 0.5 } else { 1.0 };
            } else {
                high = (x, value);
                kept = kept.min(0) - 1;
                low.1 *= if kept < -1 { 0.5 } else { 1.0 };
            }
        }
        (low.0 + high.0) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::Search;

    const SEARCH: Search = Search {
        range: [-1.0, 3.0],
        guess: 0.5,
        slope: 2.0,
        step: 0.1,
        grain: 1e-6,
        tolerance: 1e-9,
    };

    #[test]
    fn a_line_takes_four_tries() {
        let mut tries = 0;
        let x = SEARCH.falling(|x| {
            tries += 1;
            0.65 - x
        });
        assert!((x - 0.65).abs() < 1e-9 && tries <= 4, "{x} after {tries}");
    }

    #[test]
    fn curves_and_steps_are_crossed_from_both_sides() {
        for zero in [-0.9f64, 0.1, 0.5, 1.7, 2.9] {
            let x = SEARCH.falling(|x| zero.exp() - x.exp());
            assert!((x - zero).abs() < 1e-5, "{x} for {zero}");
            let x = SEARCH.falling(|x| if x < zero { 7.0 } else { -0.1 });
            assert!((x - zero).abs() < 1e-5, "{x} for a step at {zero}");
        }
    }

    #[test]
    fn without_a_crossing_it_is_an_end_of_the_range() {
        assert_eq!(SEARCH.falling(|_| 1.0), 3.0);
        assert_eq!(SEARCH.falling(|_| -1.0), -1.0);
    }
}
