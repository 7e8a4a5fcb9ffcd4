//! Whether a tree stands. Files of tools whose z axis points up hold trees that lie on their side, and nothing in
//! them says so.

use glam::Vec3;

use super::tree::Skeleton;

/// Sine of the angle above the horizon under which a trunk lies: 20 degrees. A palm that leans over a beach has more.
const LEVEL: f32 = 0.34;

/// Trunks that run in as many directions as that cancel more than this share of each other, and tell nothing: a
/// lattice, stems that spread over the ground.
const COMMON: f32 = 0.7;

/// The direction in which a tree lies, a unit vector; `None` where it stands, or has no trunk.
///
/// It is the mean direction of all trunks from base to tip, weighted by their wood.
pub fn lies(skeleton: &Skeleton) -> Option<Vec3> {
    let trunks = skeleton
        .chains
        .iter()
        .filter(|chain| chain.parent.is_none());
    let pairs = trunks.flat_map(|chain| chain.nodes.windows(2));
    let (sum, all) = pairs.fold((Vec3::ZERO, 0.0), |(sum, all), pair| {
        let [a, b] = [pair[0], pair[1]].map(|n| &skeleton.nodes[n as usize]);
        let thick = (a.radius + b.radius) / 2.0;
        let step = (b.position - a.position) * thick * thick;
        (sum + step, all + step.length())
    });
    let common = sum.length() > COMMON * all;
    let way = sum.normalize_or_zero();
    (common && way.y.abs() < LEVEL).then_some(way)
}

/// What to say of a tree that lies in this direction.
pub fn warning(way: Vec3) -> String {
    let [x, z] = [way.x, way.z];
    let (axis, along) = match x.abs() > z.abs() {
        true => ("x", x),
        false => ("z", z),
    };
    let sign = if along > 0.0 { '+' } else { '-' };
    format!("the trunk runs along {sign}{axis}: {HELP}")
}

/// What to do about it.
pub const HELP: &str = "the tree lies on its side, and in glTF y points up; export it with y up, or turn its root node";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::tree::{Chain, NO_NODE, Node};

    /// Trunks of two nodes each, from the origin.
    fn trunks(tips: &[Vec3]) -> Skeleton {
        let node = |chain, position, parent| Node {
            position,
            radius: 0.1,
            parent,
            chain,
        };
        let mut out = Skeleton::default();
        for (chain, &tip) in (0..).zip(tips) {
            let first = out.nodes.len() as u32;
            out.nodes.push(node(chain, Vec3::ZERO, NO_NODE));
            out.nodes.push(node(chain, tip, first));
            out.chains.push(Chain {
                nodes: vec![first, first + 1],
                ..Chain::default()
            });
        }
        out
    }

    #[test]
    fn a_trunk_along_z_lies_and_one_that_leans_stands() {
        let lying = lies(&trunks(&[Vec3::new(0.1, 0.2, -1.0)])).unwrap();
        assert!(warning(lying).contains("along -z"), "{}", warning(lying));
        let lying = lies(&trunks(&[Vec3::X])).unwrap();
        assert!(warning(lying).contains("along +x"));
        assert_eq!(lies(&trunks(&[Vec3::new(1.0, 0.5, 0.0)])), None);
        assert_eq!(lies(&trunks(&[-Vec3::Y])), None);
    }

    #[test]
    fn stems_that_spread_over_the_ground_tell_nothing() {
        let around = [Vec3::X, Vec3::Z, -Vec3::X, -Vec3::Z];
        assert_eq!(lies(&trunks(&around)), None);
        assert_eq!(lies(&Skeleton::default()), None);
    }

    #[test]
    fn twigs_do_not_count() {
        let mut skeleton = trunks(&[Vec3::Y, 9.0 * Vec3::X]);
        skeleton.chains[1].parent = Some(0);
        assert_eq!(lies(&skeleton), None);
    }
}
