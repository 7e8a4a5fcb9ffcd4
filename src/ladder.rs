//! Which levels: how many triangles each may have, and at which distances it is shown.

use crate::error::{Error, Result};
use crate::export::manifest::Range;
use crate::scene::Scene;

/// Levels of at most so many triangles are billboards of the whole tree.
pub const WHOLE_TREE_TRIANGLES: u64 = 24;

/// The first three of [`Wanted::Levels`] have at least so many triangles, each one after them half as many, down to a
/// whole-tree billboard: of a bush of 4,760, a hundredth leaves a third of its stems.
const NEAR_TRIANGLES: u64 = 4 * WHOLE_TREE_TRIANGLES;

/// Levels where nothing else is asked for.
pub const DEFAULT_LEVELS: usize = 4;

/// The least that a level can be drawn with: three cards of two triangles.
pub const LEAST_TRIANGLES: u64 = 6;

/// How many triangles a level may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most this many.
    Count(u64),
    /// At most this share of the original's, 0 to 1.
    Share(f64),
}

impl Limit {
    /// The limit in triangles for an original of `all` triangles.
    pub fn triangles(self, all: u64) -> u64 {
        match self {
            Self::Count(n) => n,
            Self::Share(s) => (s * all as f64).floor() as u64,
        }
    }
}

/// The levels that are asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Wanted {
    /// One for each limit.
    Limits(Vec<Limit>),
    /// This many at doubling distances, with 10 %, 3 %, 1 %, .3 % ... of the triangles, of small trees with at least
    /// 96, 96, 96, 48, 24 ... (no more than half of their own); the last one is a billboard of the whole tree.
    Levels(usize),
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Count(n) => write!(f, "{n}"),
            Self::Share(s) => write!(f, "{}%", s * 100.0),
        }
    }
}

/// As on the command line.
impl std::fmt::Display for Wanted {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Levels(n) => write!(f, "--levels {n}"),
            Self::Limits(limits) => {
                let all: Vec<String> = limits.iter().map(Limit::to_string).collect();
                write!(f, "--triangles {}", all.join(","))
            }
        }
    }
}

impl Default for Wanted {
    fn default() -> Self {
        Self::Levels(DEFAULT_LEVELS)
    }
}

/// One level beside level 0, before it is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// Most triangles.
    pub triangles: u64,
    /// Height of the tree in pixels where it starts.
    pub height_px: f64,
    /// Height in pixels where it ends; 0: it never does.
    pub end_px: f64,
}

/// The levels for a tree of `all` triangles, nearest first; none may have fewer than `least`.
///
/// # Errors
/// [`Error::Usage`] where limits are too small or grow, or the scene has too few heights.
pub fn rungs(wanted: &Wanted, scene: &Scene, all: u64, least: u64) -> Result<Vec<Rung>> {
    let limits = match wanted {
        Wanted::Limits(limits) => explicit(limits, all, least)?,
        Wanted::Levels(count) => shares(*count, all),
    };
    let heights = match (scene.heights_px.is_empty(), wanted) {
        (false, _) => listed(&scene.heights_px, limits.len())?,
        (true, Wanted::Levels(_)) => halving(scene.first_height_px, limits.len()),
        (true, Wanted::Limits(_)) => spread(scene.first_height_px, &limits),
    };
    let end = |i: usize| {
        heights
            .get(i + 1)
            .copied()
            .unwrap_or(scene.vanish_height_px)
    };
    let rung = |(i, &triangles): (usize, &u64)| Rung {
        triangles,
        height_px: heights[i],
        end_px: end(i),
    };
    Ok(limits.iter().enumerate().map(rung).collect())
}

/// The rungs that are seen in the scene, of a tree `height_m` high, none to farther than the scene's camera is. What is
/// left out costs nothing.
pub fn seen(rungs: Vec<Rung>, scene: &Scene, height_m: f64) -> Vec<Rung> {
    let shown = |rung: &Rung| {
        let [start, end] = [rung.height_px, rung.end_px].map(|px| scene.distance(height_m, px));
        scene.shows(start, end)
    };
    let least_px = match scene.farthest_m {
        0.0 => 0.0,
        farthest_m => height_m * scene.focal_px() / farthest_m,
    };
    let as_far_as_seen = |rung: Rung| Rung {
        end_px: rung.end_px.max(least_px.min(rung.height_px)),
        ..rung
    };
    rungs
        .into_iter()
        .filter(shown)
        .map(as_far_as_seen)
        .collect()
}

fn explicit(limits: &[Limit], all: u64, least: u64) -> Result<Vec<u64>> {
    let counts: Vec<u64> = limits.iter().map(|l| l.triangles(all)).collect();
    if let Some(i) = counts.iter().position(|&n| n < least) {
        return Err(Error::usage(
            format!(
                "level {} may have {} of {all} triangles: too few to draw a tree",
                i + 1,
                counts[i]
            ),
            "give --triangles larger numbers",
        ));
    }
    if let Some(i) = (1..counts.len()).find(|&i| counts[i] > counts[i - 1]) {
        let help = match [limits[i - 1], limits[i]] {
            [Limit::Share(_), Limit::Count(_)] => {
                "that share of this tree is fewer: ask for a larger one, or leave one of the two levels out"
            }
            _ => "order the numbers of --triangles from many to few",
        };
        return Err(Error::usage(
            format!(
                "level {} may have {} triangles, more than the nearer level's {}",
                i + 1,
                counts[i],
                counts[i - 1]
            ),
            help,
        ));
    }
    Ok(counts)
}

fn shares(count: usize, all: u64) -> Vec<u64> {
    let share = |i: usize| [0.1, 0.03][i % 2] * 0.1f64.powi((i / 2) as i32);
    let least = |i: usize| {
        let halvings = i.saturating_sub(2).min(2);
        (NEAR_TRIANGLES >> halvings)
            .min(all / 2)
            .max(WHOLE_TREE_TRIANGLES)
    };
    let near =
        (0..count.saturating_sub(1)).map(|i| Limit::Share(share(i)).triangles(all).max(least(i)));
    near.chain([WHOLE_TREE_TRIANGLES]).collect()
}

fn listed(heights: &[f64], count: usize) -> Result<Vec<f64>> {
    match heights.get(..count) {
        Some(heights) => Ok(heights.to_vec()),
        None => Err(Error::usage(
            format!(
                "the scene lists {} heights for {count} levels",
                heights.len()
            ),
            "give heights_px one number for each level, or leave it out",
        )),
    }
}

fn halving(first: f64, count: usize) -> Vec<f64> {
    (0..count).map(|i| first / 2f64.powi(i as i32)).collect()
}

/// Levels with limits of their own: from the first height down to half of it in equal ratios;
/// whole-tree billboards start at an eighth of it.
fn spread(first: f64, limits: &[u64]) -> Vec<f64> {
    let near = limits.iter().filter(|&&n| n > WHOLE_TREE_TRIANGLES).count();
    let steps = near.saturating_sub(1).max(1) as f64;
    let start = |i: usize| match i < near {
        true => first * 0.5f64.powf(i as f64 / steps),
        false => first / 8.0 / 2f64.powi((i - near) as i32),
    };
    (0..limits.len()).map(start).collect()
}

/// Where level 0 and the levels after it are shown; the tree is `height_m` high and
/// `width_to_height` times as wide.
pub fn ranges(rungs: &[Rung], scene: &Scene, height_m: f64, width_to_height: f64) -> Vec<Range> {
    let mut starts = vec![f64::INFINITY];
    starts.extend(rungs.iter().map(|r| r.height_px));
    let mut coverage = f64::INFINITY;
    let mut out = Vec::with_capacity(starts.len());
    for (i, &height_px) in starts.iter().enumerate() {
        let end_px = starts.get(i + 1).copied().unwrap_or(scene.vanish_height_px);
        let distance_m = scene.distance(height_m, height_px);
        // Falling even where the tree is larger than the screen.
        coverage = scene
            .screen_coverage(end_px, width_to_height)
            .min(coverage * 0.99);
        out.push(Range {
            distance_m,
            end_m: scene.distance(height_m, end_px),
            fade_m: [distance_m, distance_m * scene.fade],
            screen_height: height_px / f64::from(scene.screen_height_px),
            height_px,
            screen_coverage: coverage,
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(wanted: Wanted, all: u64) -> Vec<Rung> {
        rungs(&wanted, &Scene::default(), all, LEAST_TRIANGLES).unwrap()
    }

    #[test]
    fn levels_are_written_as_on_the_command_line() {
        let limits = vec![Limit::Share(0.1), Limit::Share(0.005), Limit::Count(24)];
        assert_eq!(
            Wanted::Limits(limits).to_string(),
            "--triangles 10%,0.5%,24"
        );
        assert_eq!(Wanted::default().to_string(), "--levels 4");
    }

    #[test]
    fn four_levels_at_doubling_distances() {
        let rungs = of(Wanted::default(), 100_000);
        let counts: Vec<u64> = rungs.iter().map(|r| r.triangles).collect();
        assert_eq!(counts, [10_000, 3_000, 1_000, 24]);
        let heights: Vec<f64> = rungs.iter().map(|r| r.height_px).collect();
        assert_eq!(heights, [512.0, 256.0, 128.0, 64.0]);
        // The last one never ends.
        assert_eq!((rungs[0].end_px, rungs[3].end_px), (256.0, 0.0));
    }

    #[test]
    fn levels_of_small_trees_are_not_starved() {
        let counts = |levels, all| -> Vec<u64> {
            let rungs = of(Wanted::Levels(levels), all);
            rungs.iter().map(|r| r.triangles).collect()
        };
        assert_eq!(counts(4, 4760), [476, 142, 96, 24]);
        assert_eq!(counts(6, 4760), [476, 142, 96, 48, 24, 24]);
        assert_eq!(counts(6, 500), [96, 96, 96, 48, 24, 24]);
        assert_eq!(counts(4, 100), [50, 50, 50, 24]);
        assert_eq!(counts(1, 500), [24]);
    }

    #[test]
    fn limits_and_heights_of_the_user() {
        let limits = vec![
            Limit::Share(0.1),
            Limit::Share(0.01),
            Limit::Count(24),
            Limit::Count(8),
        ];
        let rungs = of(Wanted::Limits(limits), 50_000);
        let heights: Vec<f64> = rungs.iter().map(|r| r.height_px).collect();
        assert_eq!(heights, [512.0, 256.0, 64.0, 32.0]);
        let grows = Wanted::Limits(vec![Limit::Count(50), Limit::Share(0.1)]);
        assert!(super::rungs(&grows, &Scene::default(), 1000, LEAST_TRIANGLES).is_err());
        let tiny = Wanted::Limits(vec![Limit::Share(0.001)]);
        assert!(super::rungs(&tiny, &Scene::default(), 1000, LEAST_TRIANGLES).is_err());
        let scene = Scene {
            heights_px: vec![100.0],
            ..Scene::default()
        };
        assert!(super::rungs(&Wanted::Levels(2), &scene, 1000, LEAST_TRIANGLES).is_err());
        assert_eq!(
            super::rungs(&Wanted::Levels(1), &scene, 1000, LEAST_TRIANGLES).unwrap()[0].height_px,
            100.0
        );
    }

    #[test]
    fn limits_that_grow_are_refused_with_a_way_out() {
        let refused = |limits: [Limit; 2]| {
            let wanted = Wanted::Limits(limits.to_vec());
            let found = rungs(&wanted, &Scene::default(), 930, LEAST_TRIANGLES);
            found.unwrap_err().to_string()
        };
        // 9 of 930.
        let small = refused([Limit::Share(0.01), Limit::Count(24)]);
        assert!(small.contains("leave one of the two levels out"), "{small}");
        let grows = refused([Limit::Count(9), Limit::Count(24)]);
        assert!(grows.contains("from many to few"), "{grows}");
    }

    #[test]
    fn levels_that_no_camera_sees_are_left_out() {
        // A tree of 10 m: 18.3 m at 512 pixels, 36.5 m at 256, 73.1 m at 128, 146.2 m at 64.
        let all = of(Wanted::default(), 100_000);
        let heights = |nearest_m, farthest_m| -> Vec<f64> {
            let scene = Scene {
                nearest_m,
                farthest_m,
                ..Scene::default()
            };
            let kept = seen(all.clone(), &scene, 10.0);
            kept.iter().map(|r| r.height_px).collect()
        };
        assert_eq!(heights(0.0, 0.0), [512.0, 256.0, 128.0, 64.0]);
        assert_eq!(heights(50.0, 0.0), [256.0, 128.0, 64.0]);
        assert_eq!(heights(1000.0, 0.0), [64.0]);
        assert_eq!(heights(20.0, 73.0), [512.0, 256.0]);
        assert!(heights(0.0, 10.0).is_empty());
    }

    #[test]
    fn no_level_is_made_for_farther_than_the_camera_goes() {
        let ends = |farthest_m| -> Vec<f64> {
            let scene = Scene {
                farthest_m,
                ..Scene::default()
            };
            let kept = seen(of(Wanted::default(), 100_000), &scene, 10.0);
            kept.iter().map(|r| r.end_px.round()).collect()
        };
        assert_eq!(ends(0.0), [256.0, 128.0, 64.0, 0.0]);
        assert_eq!(ends(292.3), [256.0, 128.0, 64.0, 32.0]);
        // A pixel at 9,353 m.
        assert_eq!(ends(9353.0 / 100.0), [256.0, 128.0, 100.0]);
    }

    #[test]
    fn ranges_meet_and_coverages_fall_to_zero() {
        let rungs = of(Wanted::default(), 100_000);
        let ranges = ranges(&rungs, &Scene::default(), 10.0, 40.0);
        assert_eq!(ranges.len(), 5);
        assert_eq!(
            (ranges[0].distance_m, ranges[4].screen_coverage),
            (0.0, 0.0)
        );
        assert_eq!(ranges[4].end_m, f64::INFINITY);
        for pair in ranges.windows(2) {
            assert_eq!(pair[0].end_m, pair[1].distance_m);
            assert!(pair[1].screen_coverage < pair[0].screen_coverage);
        }
    }
}
