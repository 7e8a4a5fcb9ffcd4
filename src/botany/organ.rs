//! Wood or foliage.
//!
//! Shape decides first: wood is made of tubes, and the outward normals of a tube cancel and turn
//! around its axis, whereas a leaf's normals agree or oppose each other. Parts vote for their
//! material, so that a crushed twig follows its bark. Only where a material's own parts disagree
//! (one material for all) does each part speak for itself. Alpha settles what shape can't, and
//! names break ties.

use rayon::prelude::*;

use super::leaf::signature;
use super::model::{AlphaMode, Material, Model};
use super::part::Parts;
use super::tree::Organ;

/// "Whatever has this in its name is that organ."
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct OrganRule {
    /// Looked for in the names of material and object, upper or lower case.
    pub name_contains: String,
    /// What the triangles are.
    pub organ: Organ,
}

/// Normals cancel to less than this share of the area on a tube (a half pipe keeps 0.64, a
/// leaf folded by 90 degrees 0.71).
const CLOSED_BELOW: f64 = 0.4;
/// `1 - trace(M^2)` of the normals' second moment: 0 on a plane, 1/2 around a tube, 2/3 on a ball.
const ROUND_ABOVE: f64 = 0.25;
/// Above this share of wood by triangles a whole material is wood, below its complement foliage.
const CLEAR_MAJORITY: f64 = 0.85;
/// Copies of a small closed shape that make it a needle or a fruit instead of a twig.
const MANY_COPIES: usize = 64;

/// Copies of a flat shape that make it a leaf in a file of one material.
const SOME_COPIES: usize = 8;
/// Area over the square of the mean radius below which a part is a sliver.
const SLIVER: f64 = 0.02;
/// A scrap of wood has at most this many triangles.
const MOST_SCRAP_TRIANGLES: usize = 32;

/// How one part is shaped.
#[derive(Clone, Copy, Debug, Default)]
struct Shape {
    /// Area without second sides, normalised units squared.
    area: f64,
    /// Length of the summed area vectors over the area: 1 flat, 0 closed.
    openness: f64,
    /// See [`ROUND_ABOVE`].
    roundness: f64,
}

impl Shape {
    fn is_tube(&self) -> bool {
        self.openness < CLOSED_BELOW && self.roundness > ROUND_ABOVE
    }
}

/// The organ of each part.
pub fn classify(
    model: &Model,
    parts: &Parts,
    rules: &[OrganRule],
    warnings: &mut Vec<String>,
) -> Vec<Organ> {
    let shapes: Vec<Shape> = (0..parts.triangles.len())
        .into_par_iter()
        .map(|part| shape(parts, part))
        .collect();
    let mut organs: Vec<Organ> = shapes
        .iter()
        .map(|s| {
            if s.is_tube() {
                Organ::Wood
            } else {
                Organ::Foliage
            }
        })
        .collect();
    let material_of = |part: usize| {
        let triangle = parts.triangles.get(part)[0];
        model.objects[model.triangle_object[triangle as usize] as usize].material as usize
    };
    let alike = copies(parts, &shapes, |part| organs[part] == Organ::Wood);
    let votes = count_votes(parts, &organs, &alike, model.materials.len(), material_of);
    let wood = votes.iter().any(|v| v.share() > CLEAR_MAJORITY);
    let foliage = (votes.iter()).any(|v| v.all > 0.0 && v.share() < 1.0 - CLEAR_MAJORITY);
    let leaf_like = if foliage {
        vec![0; organs.len()]
    } else {
        copies(parts, &shapes, |part| organs[part] == Organ::Foliage)
    };
    let elsewhere = Elsewhere { wood, foliage };
    for (part, organ) in organs.iter_mut().enumerate() {
        let material = material_of(part);
        let copies = alike[part].max(leaf_like[part]);
        *organ = votes[material].judge(&model.materials[material], *organ, copies, elsewhere);
    }
    keep_one_kind_of_wood(model, &shapes, &mut organs, &votes, material_of);
    apply_rules(model, parts, rules, &mut organs, warnings);
    organs
}

/// Which parts are scraps of wood: a few triangles that are no tube.
pub fn scraps(parts: &Parts, organs: &[Organ]) -> Vec<bool> {
    (0..organs.len())
        .into_par_iter()
        .map(|part| {
            organs[part] == Organ::Wood
                && parts.triangles.get(part).len() <= MOST_SCRAP_TRIANGLES
                && !shape(parts, part).is_tube()
        })
        .collect()
}

/// What the parts of one material say.
#[derive(Clone, Copy, Debug, Default)]
struct Votes {
    wood: f64,
    all: f64,
    /// Triangles in tubes that have many congruent copies.
    copied: f64,
}

impl Votes {
    fn share(&self) -> f64 {
        (self.wood - self.copied) / self.all.max(1.0)
    }

    fn judge(&self, material: &Material, own: Organ, copies: usize, elsewhere: Elsewhere) -> Organ {
        let share = self.wood / self.all.max(1.0);
        let hint = named_organ(&material.name);
        // Needles as prisms and round fruits: closed, but all alike, beside real wood.
        let needles = self.copied > CLEAR_MAJORITY * self.all && elsewhere.wood;
        if needles && hint != Some(Organ::Wood) {
            Organ::Foliage
        } else if share > CLEAR_MAJORITY {
            // Flat scraps are crushed twigs, but many like ones in a file without any other
            // foliage are its leaves.
            let leaf = own == Organ::Foliage && copies >= SOME_COPIES && !elsewhere.foliage;
            if leaf { Organ::Foliage } else { Organ::Wood }
        } else if share < 1.0 - CLEAR_MAJORITY && elsewhere.wood {
            Organ::Foliage
        } else if own == Organ::Wood && copies >= MANY_COPIES {
            hint.unwrap_or(Organ::Foliage)
        } else {
            own
        }
    }
}

/// Whether some material of the file is clearly wood, and some clearly foliage.
#[derive(Clone, Copy, Debug)]
struct Elsewhere {
    wood: bool,
    foliage: bool,
}

fn count_votes(
    parts: &Parts,
    organs: &[Organ],
    copies: &[usize],
    materials: usize,
    material_of: impl Fn(usize) -> usize,
) -> Vec<Votes> {
    let mut votes = vec![Votes::default(); materials];
    for (part, &organ) in organs.iter().enumerate() {
        let triangles = parts.triangles.get(part).len() as f64;
        let vote = &mut votes[material_of(part)];
        vote.all += triangles;
        if organ == Organ::Wood {
            vote.wood += triangles;
            if copies[part] >= MANY_COPIES {
                vote.copied += triangles;
            }
        }
    }
    votes
}

/// For each small part that is asked for, the number of those that look the same (0 for slivers
/// and all else).
fn copies(parts: &Parts, shapes: &[Shape], asked: impl Fn(usize) -> bool + Sync) -> Vec<usize> {
    let total: f64 = shapes.iter().map(|s| s.area).sum();
    let mut keys: Vec<([i64; 4], usize)> = (0..shapes.len())
        .into_par_iter()
        .filter(|&part| {
            asked(part)
                && shapes[part].area < total * 0.02
                && parts.triangles.get(part).len() <= 256
        })
        .map(|part| (signature(parts, parts.triangles.get(part)), part))
        .filter(|(sign, _)| sign.invariants[0] > SLIVER)
        .map(|(sign, part)| (sign.coarse_key(), part))
        .collect();
    keys.par_sort_unstable();
    let mut copies = vec![0; shapes.len()];
    for run in keys.chunk_by(|a, b| a.0 == b.0) {
        for &(_, part) in run {
            copies[part] = run.len();
        }
    }
    copies
}

/// A material whose parts disagree may hold closed leaves (boxes, folded blades): where another
/// material is clearly wood, what is not clearly wood is foliage.
fn keep_one_kind_of_wood(
    model: &Model,
    shapes: &[Shape],
    organs: &mut [Organ],
    votes: &[Votes],
    material_of: impl Fn(usize) -> usize,
) {
    let clear = |m: usize| votes[m].share() > CLEAR_MAJORITY;
    let wood_area: f64 = (0..organs.len())
        .filter(|&p| clear(material_of(p)))
        .map(|p| shapes[p].area)
        .sum();
    let all_area: f64 = shapes.iter().map(|s| s.area).sum();
    if wood_area < 0.02 * all_area {
        return;
    }
    for (part, organ) in organs.iter_mut().enumerate() {
        let material = material_of(part);
        let cut_out = model.materials[material].alpha_mode != AlphaMode::Opaque;
        let foliage_by_name = named_organ(&model.materials[material].name) == Some(Organ::Foliage);
        if !clear(material) && (cut_out || foliage_by_name) {
            *organ = Organ::Foliage;
        }
    }
}

fn shape(parts: &Parts, part: usize) -> Shape {
    let mut area = 0.0;
    let mut sum = glam::DVec3::ZERO;
    let mut moment = [0.0; 6];
    for &t in parts.triangles.get(part) {
        if parts.duplicate[t as usize] {
            continue;
        }
        let [a, b, c] = parts.welded[t as usize].map(|p| parts.points[p as usize].as_dvec3());
        let vector = (b - a).cross(c - a) / 2.0;
        let size = vector.length();
        if size > 0.0 {
            area += size;
            sum += vector;
            let n = vector / size;
            for (m, v) in moment.iter_mut().zip([
                n.x * n.x,
                n.y * n.y,
                n.z * n.z,
                n.x * n.y,
                n.y * n.z,
                n.z * n.x,
            ]) {
                *m += v * size;
            }
        }
    }
    if area == 0.0 {
        return Shape::default();
    }
    let [xx, yy, zz, xy, yz, zx] = moment.map(|m| m / area);
    let trace_of_square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx);
    Shape {
        area,
        openness: sum.length() / area,
        roundness: 1.0 - trace_of_square,
    }
}

/// What a name says, if it says one thing only.
fn named_organ(name: &str) -> Option<Organ> {
    const WOOD: [&str; 8] = [
        "bark", "wood", "trunk", "branch", "twig", "stem", "log", "limb",
    ];
    const FOLIAGE: [&str; 9] = [
        "leaf", "leaves", "foliage", "needle", "frond", "flower", "blossom", "petal", "fruit",
    ];
    let name = name.to_lowercase();
    let holds = |words: &[&str]| words.iter().any(|w| name.contains(w));
    match (holds(&WOOD), holds(&FOLIAGE)) {
        (true, false) => Some(Organ::Wood),
        (false, true) => Some(Organ::Foliage),
        _ => None,
    }
}

/// The user's rules; a rule that matches nothing is reported.
fn apply_rules(
    model: &Model,
    parts: &Parts,
    rules: &[OrganRule],
    organs: &mut [Organ],
    warnings: &mut Vec<String>,
) {
    let needles: Vec<String> = rules
        .iter()
        .map(|r| r.name_contains.to_lowercase())
        .collect();
    let mut used = vec![false; needles.len()];
    let rule_of_object: Vec<Option<usize>> = (model.objects.iter())
        .map(|object| {
            let material = &model.materials[object.material as usize].name;
            let names = [material.to_lowercase(), object.name.to_lowercase()];
            needles
                .iter()
                .position(|n| names.iter().any(|name| name.contains(n)))
        })
        .collect();
    for (part, organ) in organs.iter_mut().enumerate() {
        let triangle = parts.triangles.get(part)[0];
        let object = model.triangle_object[triangle as usize] as usize;
        if let Some(rule) = rule_of_object[object] {
            *organ = rules[rule].organ;
            used[rule] = true;
        }
    }
    for (rule, _) in used.iter().enumerate().filter(|(_, used)| !**used) {
        warnings.push(format!(
            "organ rule {:?} matches no material and no object",
            rules[rule].name_contains
        ));
    }
}
