//! Colours, distances and normals of all levels, from all views, at all sizes.
//!
//! The dear part is to draw an original of half a million triangles, so each view is drawn once at
//! the largest of sizes that halve into each other (512, 256, 128 ...), the smaller ones are made of
//! its pixels, and all levels pass by before the next view.

use rayon::prelude::*;

use super::schema::{Appearance, Change, Figure, Jump, Orbit, ViewAppearance};
use super::shot::Shot;
use super::silhouette::{agreement, ratio};
use super::stage::{Actor, Window, sampling};
use crate::botany::Model;
use crate::space::raster::{Coverage, Layers};
use crate::space::view::View;

/// Angle between two frames of an orbit, degrees.
const STEP_DEG: f32 = 1.0;

/// What is to be measured.
pub struct Asked<'a> {
    /// The original.
    pub original: &'a Model,
    /// Its levels, nearest first.
    pub levels: &'a [&'a Model],
    /// From where.
    pub views: &'a [View],
    /// For each level its sizes: heights of the tree in pixels.
    pub heights_px: &'a [Vec<u32>],
    /// For each level the height from which it is shown.
    pub starts_px: &'a [u32],
}

/// What was found of one level.
#[derive(Default)]
pub struct Found {
    /// Height in pixels and figures.
    pub sizes: Vec<(u32, Appearance)>,
    /// Against the next level.
    pub jump: Option<Jump>,
    /// From frame to frame.
    pub orbit: Option<Orbit>,
}

/// What one view gives for one level.
#[derive(Default)]
struct OfView {
    sizes: Vec<(u32, ViewAppearance)>,
    jump: Option<Leap>,
    orbit: Option<[ViewAppearance; 2]>,
}

/// One view of a jump.
struct Leap {
    f1: f64,
    area_ratio: f64,
    look: ViewAppearance,
}

/// Measures all levels.
pub fn appearance(asked: &Asked) -> Vec<Found> {
    let actors: Vec<Actor> = [asked.original]
        .iter()
        .chain(asked.levels)
        .map(|m| Actor::new(m, asked.original))
        .collect();
    let views: Vec<Vec<OfView>> = asked
        .views
        .par_iter()
        .map(|view| Stand::new(asked, &actors, view).measure())
        .collect();
    let mut found: Vec<Found> = asked.levels.iter().map(|_| Found::default()).collect();
    let mut columns: Vec<_> = views.into_iter().map(Vec::into_iter).collect();
    for (index, found) in found.iter_mut().enumerate() {
        let of_level = columns.iter_mut().filter_map(Iterator::next).collect();
        *found = summary(asked, index, of_level);
    }
    found
}

/// All views of one level.
fn summary(asked: &Asked, index: usize, mut views: Vec<OfView>) -> Found {
    let mut sizes: Vec<(u32, Vec<ViewAppearance>)> = Vec::new();
    for (height_px, look) in views.iter_mut().flat_map(|v| v.sizes.drain(..)) {
        match sizes.iter_mut().find(|(px, _)| *px == height_px) {
            Some((_, looks)) => looks.push(look),
            None => sizes.push((height_px, vec![look])),
        }
    }
    let orbits: Vec<[ViewAppearance; 2]> =
        views.iter_mut().filter_map(|v| v.orbit.take()).collect();
    let (level, original): (Vec<_>, Vec<_>) = orbits.into_iter().map(|[l, o]| (l, o)).unzip();
    let leaps: Vec<Leap> = views.into_iter().filter_map(|v| v.jump).collect();
    Found {
        sizes: sizes
            .into_iter()
            .map(|(px, looks)| (px, Appearance::over(looks)))
            .collect(),
        jump: (!leaps.is_empty()).then(|| {
            let of = |value: fn(&Leap) -> f64| {
                leaps.iter().map(move |l| (l.look.view.as_str(), value(l)))
            };
            Jump {
                height_px: asked.starts_px[index + 1],
                f1: Figure::least(of(|l| l.f1)),
                area_ratio: Figure::ratio(of(|l| l.area_ratio)),
                appearance: Appearance::over(leaps.iter().map(|l| l.look.clone()).collect()),
            }
        }),
        orbit: (!level.is_empty()).then(|| Orbit {
            height_px: asked.starts_px[index],
            step_deg: STEP_DEG.into(),
            level: Change::over(&level),
            original: Change::over(&original),
        }),
    }
}

/// Everything seen from one view.
struct Stand<'a> {
    asked: &'a Asked<'a>,
    actors: &'a [Actor<'a>],
    view: &'a View,
    /// The view a frame later, for views that orbits are measured from.
    next: Option<View>,
    /// The tree's height in its normalised space.
    height: f32,
}

impl<'a> Stand<'a> {
    fn new(asked: &'a Asked, actors: &'a [Actor], view: &'a View) -> Self {
        let next = (view.elevation_deg == 0.0).then(|| View {
            azimuth_deg: view.azimuth_deg + STEP_DEG,
            ..view.clone()
        });
        Self {
            asked,
            actors,
            view,
            next,
            height: asked.original.height(),
        }
    }

    fn measure(&self) -> Vec<OfView> {
        let mut out: Vec<OfView> = self
            .asked
            .levels
            .iter()
            .map(|_| OfView::default())
            .collect();
        let all = self.asked.heights_px.iter().flatten();
        for chain in chains(all.chain(self.asked.starts_px).copied().collect()) {
            self.chain(&chain, &mut out);
        }
        out
    }

    /// Sizes that halve into each other.
    fn chain(&self, chain: &[u32], out: &mut [OfView]) {
        let (top, least) = (chain[0], chain[chain.len() - 1]);
        let views: Vec<&View> = [self.view].into_iter().chain(&self.next).collect();
        let window = Window::around(self.actors, &views, self.height, top, top / least);
        let drawn = |actor: usize, view: &View| {
            let camera = window.camera(view, self.height, top);
            sizes(self.actors[actor].layers(&camera, sampling(top)), chain)
        };
        let originals: Vec<Shot> = drawn(0, self.view).map(Shot::new).collect();
        // A frame later: like with like, so the smaller sizes are made of the largest here, too.
        let starts = self.asked.starts_px.iter().any(|px| chain.contains(px));
        let next = self.next.as_ref().filter(|_| starts);
        let originals_next: Vec<Layers> = next.iter().flat_map(|view| drawn(0, view)).collect();
        // The level before at the size where the present one takes over.
        let mut before: Option<Shot> = None;
        for index in 0..out.len() {
            let mut kept = None;
            let layers = drawn(index + 1, self.view).map(Shot::new);
            for (step, (shot, &height_px)) in layers.zip(chain).enumerate() {
                if self.asked.heights_px[index].contains(&height_px) {
                    let look = self.compare(&originals[step], &shot);
                    out[index].sizes.push((height_px, look));
                }
                if self.asked.starts_px.get(index + 1) == Some(&height_px) {
                    kept = Some(shot.clone());
                }
                if self.asked.starts_px[index] == height_px {
                    let level_next = next.and_then(|view| drawn(index + 1, view).nth(step));
                    let both = level_next.zip(originals_next.get(step).cloned());
                    out[index].orbit = both.map(|(level, original)| {
                        let change = |now: &Shot, then| self.compare(now, &Shot::new(then));
                        [change(&shot, level), change(&originals[step], original)]
                    });
                    if let Some(before) = &before {
                        out[index - 1].jump = Some(self.leap(before, &shot));
                    }
                }
            }
            before = kept;
        }
    }

    fn compare(&self, before: &Shot, after: &Shot) -> ViewAppearance {
        before.compare(after, &self.view.name, self.height.into())
    }

    fn leap(&self, before: &Shot, after: &Shot) -> Leap {
        let [a, b] = [before, after].map(|shot| Coverage {
            width: shot.layers.width,
            height: shot.layers.height,
            fraction: shot.layers.coverage.clone(),
        });
        Leap {
            f1: agreement(&a, &b).f1(),
            area_ratio: ratio(b.area(), a.area()),
            look: self.compare(before, after),
        }
    }
}

/// The sizes of a chain, from a drawing of the first.
fn sizes(layers: Layers, chain: &[u32]) -> impl Iterator<Item = Layers> {
    let mut now = (layers, chain[0]);
    chain.iter().map(move |&height_px| {
        while now.1 > height_px {
            now = (now.0.halved(), now.1 / 2);
        }
        now.0.clone()
    })
}

/// Groups heights so that each is its group's first one, halved some times; largest first.
fn chains(mut heights: Vec<u32>) -> Vec<Vec<u32>> {
    heights.sort_unstable_by(|a, b| b.cmp(a));
    heights.dedup();
    let mut out: Vec<Vec<u32>> = Vec::new();
    for px in heights {
        let halves = |c: &&mut Vec<u32>| c[0].is_multiple_of(px) && (c[0] / px).is_power_of_two();
        match out.iter_mut().find(halves) {
            Some(chain) => chain.push(px),
            None => out.push(vec![px]),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_that_halve_into_each_other_are_drawn_once() {
        assert_eq!(
            chains(vec![64, 512, 100, 50, 256, 64]),
            [vec![512, 256, 64], vec![100, 50]]
        );
        assert_eq!(chains(vec![96, 64]), [vec![96], vec![64]]);
    }
}
