//! What a frame costs, over the least that anything must do: read every tree's position, compute its
//! distance, write it.
//!
//!     cargo bench --bench runtime
//!
//! A dense forest of five species, 4,992 trees and 100,000. Slow orbit: 5 cm a frame, once around
//! 40 m at eye level. Jump cut: each frame from another place. A frame is `update` (density and
//! occlusion) and `collect` of what is in the picture.

use std::hint::black_box;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use glam::Vec3;
use pleach::runtime::{
    Density, Drawn, Forest, Hidden, Hierarchy, Law, Occlusion, Place, View, shares,
};
use pleach::study::scenes::{ASPECT, CLUMPING, FOV_DEG, five_species, forest, forest_cells};

/// Side of a cell of the grid in which trees hide others, metres.
const CELL_M: f32 = 4.0;

/// One core's part of the forest.
struct Part<'g> {
    forest: Forest<Hidden<'g, Density>>,
    drawn: Vec<Drawn>,
}

impl<'g> Part<'g> {
    fn new(species: &[Hierarchy], places: &[Place], occlusion: Occlusion<'g>) -> Self {
        let hidden = Hidden::new(Density::default(), occlusion);
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

/// What frames took.
#[derive(Clone)]
struct Took {
    /// Nanoseconds of each frame, the fastest of all rounds: other work on the machine is not ours.
    frames: Vec<f64>,
    /// What was drawn in a round.
    drawn: usize,
}

impl Took {
    fn mean(&self) -> f64 {
        self.frames.iter().skip(1).sum::<f64>() / (self.frames.len() - 1) as f64
    }

    fn worst(&self) -> f64 {
        self.frames.iter().skip(1).fold(0.0f64, |a, &b| a.max(b))
    }
}

/// Forests in one part or two, and a second thread that waits for its part as the workers of an engine do: awake.
struct Cores<'s, 'g> {
    setups: &'s [Vec<Mutex<Part<'g>>>],
    /// What the second thread is to draw: which setup, from where.
    job: Mutex<(usize, View)>,
    /// Frames that it was given, and that it has done; the last given is [`ENOUGH`].
    given: AtomicU64,
    done: AtomicU64,
}

const ENOUGH: u64 = u64::MAX;

impl Cores<'_, '_> {
    /// A frame of a setup, its parts side by side.
    fn frame(&self, setup: usize, view: &View) {
        let [first, rest @ ..] = &self.setups[setup][..] else {
            return;
        };
        let given = self.given.load(Ordering::Relaxed) + 1;
        if !rest.is_empty() {
            *lock(&self.job) = (setup, *view);
            self.given.store(given, Ordering::Release);
        }
        lock(first).frame(view);
        while !rest.is_empty() && self.done.load(Ordering::Acquire) != given {
            std::hint::spin_loop();
        }
    }

    /// What is drawn.
    fn drawn(&self, setup: usize) -> usize {
        self.setups[setup].iter().map(|p| lock(p).drawn.len()).sum()
    }

    /// What the second thread does until it is enough.
    fn second(&self) {
        let mut last = 0;
        loop {
            let given = self.given.load(Ordering::Acquire);
            if given == ENOUGH {
                return;
            }
            if given == last {
                std::hint::spin_loop();
                continue;
            }
            last = given;
            let (setup, view) = *lock(&self.job);
            lock(&self.setups[setup][1]).frame(&view);
            self.done.store(given, Ordering::Release);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Walks the path several times with one core's parts and with two cores', in turns, so that what the machine does
/// besides slows both.
fn time(views: &[View], setups: &[Vec<Mutex<Part>>]) -> Vec<Took> {
    let cores = Cores {
        setups,
        job: Mutex::new((0, views[0])),
        given: AtomicU64::new(0),
        done: AtomicU64::new(0),
    };
    std::thread::scope(|scope| {
        scope.spawn(|| cores.second());
        let took = in_turns(views, &cores);
        cores.given.store(ENOUGH, Ordering::Release);
        took
    })
}

fn in_turns(views: &[View], cores: &Cores) -> Vec<Took> {
    const ROUNDS: usize = 20;
    let nothing = Took {
        frames: vec![f64::MAX; views.len()],
        drawn: 0,
    };
    let mut out = vec![nothing; cores.setups.len()];
    for _ in 0..ROUNDS {
        for (setup, took) in out.iter_mut().enumerate() {
            // Each round starts from the same cut.
            cores.frame(setup, &views[views.len() - 1]);
            took.drawn = 0;
            for (view, best) in views.iter().zip(&mut took.frames) {
                let start = Instant::now();
                cores.frame(setup, view);
                *best = best.min(start.elapsed().as_secs_f64() * 1e9);
                took.drawn += cores.drawn(setup);
            }
        }
    }
    out
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
        "{:>8}  {:<12}{:>6}{:>10}{:>12}{:>12}{:>14}{:>14}{:>14}{:>12}{:>12}",
        "trees",
        "path",
        "cores",
        "drawn",
        "floor us",
        "frame us",
        "ns a tree",
        "x floor",
        "worst x floor",
        "x one core",
        "at most"
    );
    for trees in [4992, 100_000] {
        let places = forest(&species, trees);
        let cells = forest_cells(&species, &places, CELL_M, None);
        let floor = floor(&places);
        let half = 0.4 * 3.5 * (trees as f32).sqrt();
        for (name, views) in [("slow orbit", orbit()), ("jump cut", jumps(half))] {
            let [alone, both, one, other] = [1, 2, 1, 1].map(|cores| {
                let occlusion = Occlusion::new(&cells, Law::Beer).clumped(CLUMPING);
                let part = |share: &Vec<u32>| {
                    let own: Vec<Place> = share.iter().map(|&i| places[i as usize]).collect();
                    Part::new(&hierarchies, &own, occlusion.clone())
                };
                let shares = shares(&places, cores, 2.0 * CELL_M);
                shares.iter().map(part).map(Mutex::new).collect::<Vec<_>>()
            });
            // Two forests that have nothing to do with each other: what two cores of this machine can do at all.
            let apart = one.into_iter().chain(other).collect();
            let took = time(&views, &[alone, both, apart]);
            let one = took[0].mean();
            let can = 2.0 * one / took[2].mean();
            for (cores, took) in (1..).zip(&took[..2]) {
                println!(
                    "{trees:>8}  {name:<12}{cores:>6}{:>10.0}{:>12.2}{:>12.1}{:>14.1}{:>14.1}{:>14.1}{:>12.2}{:>12}",
                    took.drawn as f64 / views.len() as f64,
                    floor / 1e3,
                    took.mean() / 1e3,
                    took.mean() / trees as f64,
                    took.mean() / floor,
                    took.worst() / floor,
                    one / took.mean(),
                    match cores {
                        1 => String::new(),
                        _ => format!("{can:.2}"),
                    },
                );
            }
        }
    }
}
