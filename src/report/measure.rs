//! All figures that need pictures: every level from all views at its sizes, beside the original.
//!
//! The dear part is to draw an original of half a million triangles. Each of its pictures is drawn
//! once and serves silhouettes, colours, depths and normals of all levels.

use rayon::prelude::*;

use super::asked::Asked;
use super::outline::{Outline, summary};
use super::schema::{
    Appearance, Change, Figure, Jump, Orbit, Sampled, SizeFigures, ViewAppearance,
};
use super::stage::Actor;
use super::stand::{FEW_SIDES, Leap, OfSize, OfView, STEP_DEG, Stand};
use crate::space::raster::Tone;

/// What was found of one model.
#[derive(Default)]
pub struct Found {
    /// Largest first.
    pub sizes: Vec<SizeFigures>,
    /// Against the next level.
    pub jump: Option<Jump>,
    /// From frame to frame.
    pub orbit: Option<Orbit>,
}

/// Measures the original and all levels, in that order, at all `heights_px`; `seen` is called after
/// each view, by any thread.
///
/// # Errors
/// Those of `seen`.
pub fn measure<E: Send>(
    asked: &Asked,
    actors: &[Actor],
    heights_px: &[u32],
    seen: &(dyn Fn() -> Result<(), E> + Sync),
) -> Result<Vec<Found>, E> {
    let height = asked.original.height();
    let from = |view| {
        let found = Stand::new(asked, actors, (view, height)).measure(heights_px);
        seen().map(|()| found)
    };
    let mut views: Vec<Vec<OfView>> = asked.views.par_iter().map(from).collect::<Result<_, E>>()?;
    let moved: Vec<(u32, f64)> = heights_px
        .iter()
        .map(|&px| (px, moved(&views, px)))
        .collect();
    let all = (0..actors.len()).map(|actor| {
        let of_actor = views.iter_mut().map(|v| std::mem::take(&mut v[actor]));
        found(asked, actor, of_actor.collect(), &moved)
    });
    Ok(all.collect())
}

/// Everything that drawing needs of the models of a measurement.
pub fn actors<'a>(asked: &Asked<'a>) -> Vec<Actor<'a>> {
    let colors = asked.looks || asked.causes;
    [asked.original]
        .iter()
        .chain(asked.levels)
        .map(|model| Actor::new(model, asked.original, colors))
        .collect()
}

/// Mean F1 of the original moved by half a pixel.
fn moved(views: &[Vec<OfView>], height_px: u32) -> f64 {
    let all = views.iter().filter_map(|actors| actors.first());
    let sizes = all.filter_map(|v| v.sizes.iter().find(|s| s.height_px == height_px));
    sizes.map(|s| s.moved_f1 / views.len() as f64).sum()
}

/// All views of one model.
fn found(asked: &Asked, actor: usize, mut views: Vec<OfView>, moved: &[(u32, f64)]) -> Found {
    let all: Vec<Vec<OfSize>> = views
        .iter_mut()
        .map(|v| std::mem::take(&mut v.sizes))
        .collect();
    let sizes = moved.iter().filter_map(|&(height_px, moved_f1)| {
        let of_size = all.iter().flatten().filter(|s| s.height_px == height_px);
        figures(height_px, moved_f1, &of_size.collect::<Vec<_>>())
    });
    let starts = actor.checked_sub(1);
    let start = starts.and_then(|level| asked.starts_px.get(level));
    let next = starts.and_then(|level| asked.starts_px.get(level + 1));
    let sizes = sizes.collect();
    let leaps: Vec<Leap> = views.iter_mut().filter_map(|v| v.jump.take()).collect();
    let orbits = views.into_iter().filter_map(|v| v.orbit);
    Found {
        sizes,
        jump: next.and_then(|&px| jump(px, leaps)),
        orbit: start.and_then(|&px| orbit(px, orbits.collect())),
    }
}

/// All views of one model at one size; `None` where it was not asked for.
fn figures(height_px: u32, moved_f1: f64, views: &[&OfSize]) -> Option<SizeFigures> {
    let outlines = |of: fn(&OfSize) -> Option<&Outline>| -> Option<SizeFigures> {
        let all: Vec<Outline> = views.iter().filter_map(|v| of(v).cloned()).collect();
        (!all.is_empty()).then(|| summary(height_px, moved_f1, &all))
    };
    let mut client = outlines(|v| v.client.as_ref());
    if let Some(client) = &mut client {
        let all: Tone = views.iter().filter_map(|v| v.base_color).sum();
        client.base_color_linear = all.mean();
        client.sampled = sampled(views);
    }
    let looks: Vec<ViewAppearance> = views.iter().filter_map(|v| v.look.clone()).collect();
    Some(SizeFigures {
        client: client.map(Box::new),
        appearance: (!looks.is_empty()).then(|| Box::new(Appearance::over(looks))),
        ..outlines(|v| v.outline.as_ref())?
    })
}

/// What F1 falls to with few samples, over all views.
fn sampled(views: &[&OfSize]) -> Vec<Sampled> {
    let of = |(number, side): (usize, &u32)| {
        let all = views.iter().filter_map(|v| v.few_samples.as_ref());
        let outlines: Vec<&Outline> = all.map(|few| &few[number]).collect();
        (!outlines.is_empty()).then(|| Sampled {
            samples: side * side,
            f1: Figure::least(outlines.iter().map(|o| (o.view(), o.f1()))),
        })
    };
    FEW_SIDES.iter().enumerate().filter_map(of).collect()
}

fn jump(height_px: u32, leaps: Vec<Leap>) -> Option<Jump> {
    let of = |value: fn(&Leap) -> f64| leaps.iter().map(move |l| (l.look.view.as_str(), value(l)));
    (!leaps.is_empty()).then(|| Jump {
        height_px,
        f1: Figure::least(of(|l| l.outline.f1())),
        area_ratio: Figure::ratio(of(|l| l.outline.area_ratio())),
        appearance: Appearance::over(leaps.iter().map(|l| l.look.clone()).collect()),
    })
}

fn orbit(height_px: u32, views: Vec<[ViewAppearance; 2]>) -> Option<Orbit> {
    let (level, original): (Vec<_>, Vec<_>) = views.into_iter().map(|[l, o]| (l, o)).unzip();
    (!level.is_empty()).then(|| Orbit {
        height_px,
        step_deg: STEP_DEG.into(),
        level: Change::over(&level),
        original: Change::over(&original),
    })
}
