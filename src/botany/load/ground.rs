//! The ground that a tree stands on in a file, which no level should show.
//!
//! A lawn is wider than a crown, and from below a card of it covers more than all leaves.

use glam::{DMat4, DVec3};

use super::primitive::{Part, Parts};
use super::scene::Placement;
use super::warning::Warnings;

/// Share of a part's area that is level: slopes of 25 degrees have .9.
const LEVEL: f64 = 0.9;

/// Share of the tree's height above its foot under which ground ends, and that it is thick at most.
const FOOT: f64 = 0.1;

/// Share of the rest's extent along both axes from which a part is as wide as ground.
const WIDE: f64 = 0.25;

/// Bounds of some points.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NONE: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn size(self) -> DVec3 {
        self.high - self.low
    }

    /// Whether a point is above or below.
    fn holds(self, p: DVec3) -> bool {
        (self.low.x..=self.high.x).contains(&p.x) && (self.low.z..=self.high.z).contains(&p.z)
    }

    fn of(points: impl Iterator<Item = DVec3>) -> Self {
        points.fold(Self::NONE, |all, p| all.with(Self { low: p, high: p }))
    }
}

/// Drops parts that are ground, and says which.
pub(super) fn drop_ground(placements: &[Placement], parts: &mut Parts, warnings: &mut Warnings) {
    let mut ground = find(placements, parts);
    for &(at, part) in &ground {
        let what = "a level sheet under the tree is taken for ground, and left out; join it with the trunk's mesh to keep it";
        let placed = &placements[at];
        let primitive = parts[placed.mesh][part].primitive;
        let place = format!(
            "{}, mesh {}, primitive {primitive}",
            placed.name, placed.mesh
        );
        warnings.say(what, place.trim_start_matches(", "));
    }
    // From the last on: numbers of those before stay.
    ground.sort_unstable_by_key(|&(at, part)| (placements[at].mesh, part));
    for (at, part) in ground.into_iter().rev() {
        parts[placements[at].mesh].remove(part);
    }
}

/// Ground: the number of a placement, and of a part of its mesh.
fn find(placements: &[Placement], parts: &Parts) -> Vec<(usize, usize)> {
    let mut times = vec![0u32; parts.len()];
    placements.iter().for_each(|p| times[p.mesh] += 1);
    let of_each = placements.iter().enumerate();
    let pieces =
        of_each.flat_map(|(at, placed)| (0..parts[placed.mesh].len()).map(move |p| (at, p)));
    let pieces: Vec<(usize, usize)> = pieces.collect();
    let piece = |&(at, part): &(usize, usize)| {
        let placed = &placements[at];
        (placed, &parts[placed.mesh][part])
    };
    let bounds = |p: &(usize, usize)| Bounds::of(world(piece(p)));
    let bounds: Vec<Bounds> = pieces.iter().map(bounds).collect();
    let all = bounds.iter().fold(Bounds::NONE, |all, &b| all.with(b));
    let is_sheet = |at: &usize| {
        // What is placed several times is a leaf.
        let (placed, part) = piece(&pieces[*at]);
        let (size, foot) = (bounds[*at].size(), FOOT * all.size().y);
        let is_thin = size.y <= foot && bounds[*at].low.y <= all.low.y + foot;
        is_thin && times[placed.mesh] == 1 && is_level(placed.world_from_mesh, part)
    };
    let (sheets, rest): (Vec<usize>, Vec<usize>) = (0..pieces.len()).partition(is_sheet);
    let rest = rest
        .iter()
        .fold(Bounds::NONE, |all, &at| all.with(bounds[at]));
    let foot = rest.low.y + FOOT * rest.size().y;
    let is_ground = |at: &usize| {
        let (own, rest) = (bounds[*at].size(), rest.size());
        let is_wide = own.x >= WIDE * rest.x && own.z >= WIDE * rest.z;
        is_wide && own.y <= FOOT * rest.y && bounds[*at].high.y <= foot
    };
    let mut ground: Vec<usize> = sheets.into_iter().filter(is_ground).collect();
    if ground.is_empty() {
        return Vec::new();
    }
    // It is under the trunk, and not a leaf that lies beside it.
    let others = (0..pieces.len()).filter(|at| !ground.contains(at));
    let points = others.flat_map(|at| world(piece(&pieces[at])));
    let trunk = Bounds::of(points.filter(|p| p.y <= foot));
    let middle = trunk.low + 0.5 * trunk.size();
    ground.retain(|&at| bounds[at].holds(middle));
    ground.into_iter().map(|at| pieces[at]).collect()
}

fn world<'a>((placed, part): (&'a Placement, &'a Part)) -> impl Iterator<Item = DVec3> + 'a {
    let points = part.positions.iter();
    points.map(|p| placed.world_from_mesh.transform_point3(p.as_dvec3()))
}

/// Whether a part's triangles face up or down.
fn is_level(world_from_mesh: DMat4, part: &Part) -> bool {
    let (mut level, mut all) = (0.0, 0.0);
    for t in &part.triangles {
        let corner =
            |i: u32| world_from_mesh.transform_point3(part.positions[i as usize].as_dvec3());
        let [a, b, c] = t.map(corner);
        let area = (b - a).cross(c - a);
        (level, all) = (level + area.y.abs(), all + area.length());
    }
    all > 0.0 && level >= LEVEL * all
}
