//! What a frame costs, over the least that anything must do: read every tree's position, compute its
//! distance, write it.
//!
//!     cargo bench --bench runtime
//!
//! A dense forest of five species, 4,992 trees and 100,000. Slow orbit: 5 cm a frame, once around
//! 40 m at eye level. Jump cut: each frame from another place. A frame is `update` (density and
//! occlusion) and `collect` of what is in the picture.

use std::hint::black_box;
use std::time::Instant;

use glam::Vec3;
use pleach::runtime::{
    Cells, Density, Drawn, Forest, Hidden, Hierarchy, Law, Occlusion, Place, View,
};
use pleach::study::scenes::{ASPECT, CLUMPING, FOV_DEG, five_species, forest, forest_cells};

/// One core's part of the forest.
struct Part<'g> {
    forest: Forest<Hidden<'g, Density>>,
    drawn: Vec<Drawn>,
}

impl<'g> Part<'g> {
    fn new(species: &[Hierarchy], places: &[Place], cells: &'g Cells) -> Self {
        let occlusion = Occlusion::new(cells, Law::Beer).clumped(CLUMPING);
        let hidden = Hidden {
            inner: Density::default(),
            occlusion,
        };
        Self {
            forest: Forest::new(species.to_vec(), places, hidden),
            drawn: Vec::new(),
        }
    }

    fn frame(&mut self, view: &View) {
        self.forest.update(view);
        self.drawn.clear();
        self.forest.collect(view, &mut self.drawn);
        black_box(&self.drawn);
    }
}

fn looking(eye: Vec3, angle: f32) -> View {
    View::looking(
        eye,
        Vec3::new(angle.cos(), 0.05, angle.sin()),
        FOV_DEG.to_radians(),
        ASPECT,
    )
}

fn orbit() -> Vec<View> {
    (0..1000)
        .map(|i| {
            let angle = i as f32 * 0.05 / 40.0;
            looking(
                Vec3::new(40.0 * angle.cos(), 1.7, 40.0 * angle.sin()),
                angle + 2.5,
            )
        })
        .collect()
}

fn jumps(half: f32) -> Vec<View> {
    let place = |i: usize, by: f32| ((i as f32 * by).fract() * 2.0 - 1.0) * half;
    (0..100)
        .map(|i| {
            looking(
                Vec3::new(place(i, 0.618_034), 1.7, place(i, 0.414_214)),
                i as f32,
            )
        })
        .collect()
}

/// Nanoseconds a frame, mean and worst over frames, and what was drawn. The path is walked several
/// times and each frame counts by its fastest time, as the floor does: other work on the machine is not ours.
fn time(views: &[View], mut frame: impl FnMut(&View) -> usize) -> [f64; 3] {
    const ROUNDS: usize = 20;
    let mut best = vec![f64::MAX; views.len()];
    let mut drawn = 0;
    for _ in 0..ROUNDS {
        // Each round starts from the same cut.
        frame(&views[views.len() - 1]);
        drawn = 0;
        for (view, best) in views.iter().zip(&mut best) {
            let start = Instant::now();
            drawn += frame(view);
            *best = best.min(start.elapsed().as_secs_f64() * 1e9);
        }
    }
    let worst = best.iter().skip(1).fold(0.0f64, |a, &b| a.max(b));
    let mean = best.iter().skip(1).sum::<f64>() / (views.len() - 1) as f64;
    [mean, worst, drawn as f64 / views.len() as f64]
}

/// Nanoseconds for the least that anything must do: the fastest of many rounds.
fn floor(places: &[Place]) -> f64 {
    let positions: Vec<Vec3> = places.iter().map(|p| p.position).collect();
    let mut distances = vec![0.0f32; positions.len()];
    let mut best = f64::MAX;
    for round in 0..200 {
        let eye = black_box(Vec3::new(round as f32, 1.7, 0.0));
        let start = Instant::now();
        for (distance, position) in distances.iter_mut().zip(&positions) {
            *distance = position.distance(eye);
        }
        black_box(&distances);
        best = best.min(start.elapsed().as_secs_f64() * 1e9);
    }
    best
}

fn main() {
    let species = match five_species() {
        Ok(species) => species,
        Err(error) => {
            eprintln!("error: {error}");
            std::process::exit(1);
        }
    };
    let hierarchies: Vec<Hierarchy> = species.iter().map(|s| s.hierarchy.clone()).collect();
    println!(
        "{:>8}  {:<12}{:>6}{:>10}{:>12}{:>12}{:>14}{:>14}{:>14}",
        "trees",
        "path",
        "cores",
        "drawn",
        "floor us",
        "frame us",
        "ns a tree",
        "x floor",
        "worst x floor"
    );
    for trees in [4992, 100_000] {
        let places = forest(&species, trees);
        let cells = forest_cells(&species, &places, 4.0, None);
        let floor = floor(&places);
        let half = 0.4 * 3.5 * (trees as f32).sqrt();
        for (name, views) in [("slow orbit", orbit()), ("jump cut", jumps(half))] {
            for cores in [1, 2] {
                // Every second tree for each of two: what is near, and costs most, is shared alike.
                let part = |core: usize| -> Vec<Place> {
                    places.iter().copied().skip(core).step_by(cores).collect()
                };
                let mut parts: Vec<Part> = (0..cores)
                    .map(|core| Part::new(&hierarchies, &part(core), &cells))
                    .collect();
                let mut frame = |view: &View| {
                    match &mut parts[..] {
                        [a, b] => drop(rayon::join(|| a.frame(view), || b.frame(view))),
                        all => all.iter_mut().for_each(|p| p.frame(view)),
                    }
                    parts.iter().map(|p| p.drawn.len()).sum()
                };
                // From a thread of the pool, as in an engine's jobs: nobody has to be woken from outside.
                let (mean, worst, drawn) = rayon::scope(|_| time(&views, &mut frame)).into();
                println!(
                    "{trees:>8}  {name:<12}{cores:>6}{drawn:>10.0}{:>12.2}{:>12.1}{:>14.1}{:>14.1}{:>14.1}",
                    floor / 1e3,
                    mean / 1e3,
                    mean / trees as f64,
                    mean / floor,
                    worst / floor
                );
            }
        }
    }
}
