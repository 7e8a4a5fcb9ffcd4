//! Recognition on models small enough to know the answer, and on models that mean harm.

use glam::{Quat, Vec2, Vec3};
use pleach::botany::model::{Material, Model, Object};
use pleach::botany::recognise::{OrganRule, RecogniseOptions, recognise};
use pleach::botany::tree::{NO_NODE, Organ, Tree};

const BARK: u32 = 0;
const LEAF: u32 = 1;

/// A model under construction; material 0 and 1, without names.
struct Builder {
    model: Model,
}

impl Builder {
    fn new() -> Self {
        let object = |material| Object {
            material,
            ..Object::default()
        };
        Self {
            model: Model {
                name: "hand made".to_owned(),
                objects: vec![object(BARK), object(LEAF)],
                materials: vec![Material::default(); 2],
                ..Model::default()
            },
        }
    }

    fn vertex(&mut self, p: Vec3) -> u32 {
        self.model.positions.push(p);
        self.model.normals.push(Vec3::Y);
        self.model.uvs[0].push(Vec2::ZERO);
        self.model.positions.len() as u32 - 1
    }

    fn triangle(&mut self, material: u32, corners: [u32; 3]) {
        self.model.triangles.push(corners);
        self.model.triangle_object.push(material);
    }

    /// An open tube with six sides along some points.
    fn tube(&mut self, material: u32, line: &[(Vec3, f32)]) -> &mut Self {
        let sides = 6;
        let axis = (line[line.len() - 1].0 - line[0].0).normalize();
        let u = axis.any_orthonormal_vector();
        let mut below: Option<Vec<u32>> = None;
        for &(center, radius) in line {
            let ring: Vec<u32> = (0..sides)
                .map(|i| {
                    let turn = std::f32::consts::TAU * i as f32 / sides as f32;
                    let out = Quat::from_axis_angle(axis, turn) * u;
                    self.vertex(center + out * radius)
                })
                .collect();
            if let Some(below) = below {
                for i in 0..sides {
                    let j = (i + 1) % sides;
                    self.triangle(material, [below[i], below[j], ring[j]]);
                    self.triangle(material, [below[i], ring[j], ring[i]]);
                }
            }
            below = Some(ring);
        }
        self
    }

    /// A rectangle that stands on `foot`.
    fn quad(&mut self, foot: Vec3, up: Vec3, side: Vec3) -> &mut Self {
        let corners = [foot - side, foot + side, foot + side + up, foot - side + up];
        let c = corners.map(|p| self.vertex(p));
        self.triangle(LEAF, [c[0], c[1], c[2]]);
        self.triangle(LEAF, [c[0], c[2], c[3]]);
        self
    }

    fn recognise(&self) -> Tree {
        recognise(self.model.clone(), &RecogniseOptions::default()).unwrap()
    }
}

fn straight(from: Vec3, to: Vec3, radii: [f32; 2], segments: usize) -> Vec<(Vec3, f32)> {
    (0..=segments)
        .map(|i| {
            let t = i as f32 / segments as f32;
            (from.lerp(to, t), radii[0] + (radii[1] - radii[0]) * t)
        })
        .collect()
}

fn trunk() -> Vec<(Vec3, f32)> {
    straight(Vec3::NEG_Y, Vec3::Y * 0.8, [0.1, 0.04], 9)
}

/// A trunk, two branches that start in the same point of its centre line, a twig on the first.
fn small_tree() -> Builder {
    let mut b = Builder::new();
    let fork = Vec3::ZERO;
    let (left, right) = (Vec3::new(-0.6, 0.4, 0.0), Vec3::new(0.6, 0.4, 0.0));
    b.tube(BARK, &trunk())
        .tube(BARK, &straight(fork, left, [0.03, 0.01], 6))
        .tube(BARK, &straight(fork, right, [0.03, 0.01], 6))
        .tube(
            BARK,
            &straight(left * 0.5, left * 0.5 + Vec3::Z * 0.3, [0.008, 0.004], 3),
        );
    for i in 0..8 {
        let t = 0.3 + 0.08 * i as f32;
        b.quad(left * t, Vec3::new(0.0, 0.1, 0.03), Vec3::Z * 0.02);
        b.quad(right * t, Vec3::new(0.0, 0.1, 0.03), Vec3::Z * 0.02);
    }
    b
}

#[test]
fn a_small_tree_is_recognised_as_it_was_built() {
    let tree = small_tree().recognise();
    assert_eq!(tree.leaves.len(), 16);
    assert_eq!(tree.leaf_classes.len(), 1);
    let chains = &tree.skeleton.chains;
    assert_eq!(chains.len(), 4);
    let parents: Vec<_> = chains.iter().map(|c| (c.parent, c.order)).collect();
    assert_eq!(
        parents,
        [(None, 0), (Some(0), 1), (Some(0), 1), (Some(1), 2)]
    );
    // Rings are nodes: the third ring of the trunk is at -0.6 and as wide as it was made.
    let node = tree.skeleton.nodes[chains[0].nodes[2] as usize];
    assert!(node.position.abs_diff_eq(Vec3::new(0.0, -0.6, 0.0), 1e-5));
    assert!((node.radius - (0.1 - 0.06 * 2.0 / 9.0)).abs() < 1e-5);
    for leaf in &tree.leaves {
        let chain = tree.skeleton.nodes[leaf.node as usize].chain;
        assert_eq!(chain, if leaf.center.x < 0.0 { 1 } else { 2 });
    }
    // The hierarchy: whole, trunk, two branches, twig.
    assert_eq!(tree.subtrees.len(), 5);
    assert_eq!(tree.subtrees[0].leaf_count, 16);
    assert_eq!(tree.subtrees[1].leaf_count, 16);
    assert_eq!(tree.subtrees[2].leaf_count, 8);
    for (t, &node) in tree.wood_node.iter().enumerate() {
        assert_eq!(node == NO_NODE, tree.organ[t] == Organ::Foliage);
    }
}

/// Every sub-tree's sphere holds all of its triangles and those of what it carries.
#[test]
fn spheres_hold_what_they_bound() {
    let tree = small_tree().recognise();
    for leaf in &tree.leaves {
        let mut at = Some(tree.skeleton.nodes[leaf.node as usize].chain + 1);
        while let Some(index) = at {
            let subtree = &tree.subtrees[index as usize];
            let (center, radius) = subtree.sphere;
            for &t in &leaf.triangles {
                for p in tree.model.corners(t) {
                    assert!(p.distance(center) <= radius * 1.0001);
                }
            }
            at = subtree.parent;
        }
    }
}

#[test]
fn order_of_triangles_does_not_matter() {
    let builder = small_tree();
    let one = builder.recognise();
    let mut shuffled = small_tree();
    let count = shuffled.model.triangles.len();
    let order: Vec<usize> = (0..count).map(|i| (i * 7919 + 13) % count).collect();
    let mut sorted = order.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), count, "the shuffle must be a permutation");
    let model = &builder.model;
    shuffled.model.triangles = order.iter().map(|&i| model.triangles[i]).collect();
    shuffled.model.triangle_object = order.iter().map(|&i| model.triangle_object[i]).collect();
    let two = shuffled.recognise();
    let describe = |tree: &Tree| {
        let mut lines: Vec<String> = (tree.skeleton.chains.iter())
            .map(|c| {
                let at = |n: u32| (tree.skeleton.nodes[n as usize].position * 1e4).round();
                let leaves = tree.leaves.iter().filter(|l| {
                    tree.skeleton.nodes[l.node as usize].chain
                        == tree.skeleton.nodes[c.nodes[0] as usize].chain
                });
                let line: Vec<_> = c.nodes.iter().map(|&n| at(n).as_ivec3()).collect();
                format!("{line:?} order {} leaves {}", c.order, leaves.count())
            })
            .collect();
        lines.sort();
        lines
    };
    assert_eq!(describe(&one), describe(&two));
}

#[test]
fn soup_is_welded() {
    let builder = small_tree();
    let mut soup = Builder::new();
    for (t, &object) in builder
        .model
        .triangles
        .iter()
        .zip(&builder.model.triangle_object)
    {
        let corners = t.map(|i| soup.vertex(builder.model.positions[i as usize]));
        soup.triangle(object, corners);
    }
    let (a, b) = (builder.recognise(), soup.recognise());
    assert_eq!(a.skeleton.chains.len(), b.skeleton.chains.len());
    assert_eq!(a.leaves.len(), b.leaves.len());
    let parents = |t: &Tree| {
        t.skeleton
            .chains
            .iter()
            .map(|c| c.parent)
            .collect::<Vec<_>>()
    };
    assert_eq!(parents(&a), parents(&b));
}

/// A base ring that floats just outside its parent still finds it.
#[test]
fn a_floating_branch_is_joined() {
    let mut b = Builder::new();
    b.tube(BARK, &trunk());
    let start = Vec3::new(0.11, 0.0, 0.0);
    b.tube(
        BARK,
        &straight(start, start + Vec3::X * 0.5, [0.02, 0.01], 4),
    );
    let tree = b.recognise();
    assert_eq!(tree.skeleton.chains[1].parent, Some(0));
    let base = tree.skeleton.nodes[tree.skeleton.chains[1].nodes[0] as usize];
    assert!(base.position.abs_diff_eq(start, 1e-4));
}

/// A cylinder that was made from tip to base is turned round where it touches its parent.
#[test]
fn a_cylinder_grows_from_where_it_touches() {
    let mut b = Builder::new();
    b.tube(BARK, &trunk());
    b.tube(BARK, &straight(Vec3::X * 0.6, Vec3::ZERO, [0.02, 0.02], 4));
    let tree = b.recognise();
    let chain = &tree.skeleton.chains[1];
    let base = tree.skeleton.nodes[chain.nodes[0] as usize];
    assert!(base.position.length() < 1e-4, "base at {}", base.position);
    assert_eq!(chain.parent, Some(0));
}

#[test]
fn one_cylinder_a_segment_is_one_branch() {
    let mut b = Builder::new();
    let line = straight(Vec3::NEG_Y, Vec3::Y, [0.1, 0.05], 8);
    for pair in line.windows(2) {
        // Each starts a little inside the one before.
        let (foot, radius) = pair[0];
        b.tube(BARK, &[(foot - Vec3::Y * 0.01, radius), pair[1]]);
    }
    let tree = b.recognise();
    assert_eq!(tree.skeleton.chains.len(), 1);
    assert_eq!(tree.skeleton.nodes.len(), 16);
}

/// One welded skin: a cross of square tubes, traced by level sets.
#[test]
fn a_branching_skin_gives_several_chains() {
    let mut b = Builder::new();
    let mut ring = |y: f32, r: f32| -> [u32; 4] {
        [(r, r), (-r, r), (-r, -r), (r, -r)].map(|(x, z)| b.vertex(Vec3::new(x, y, z)))
    };
    let rings: Vec<[u32; 4]> = (0..=20)
        .map(|i| ring(-1.0 + 0.1 * i as f32, 0.05))
        .collect();
    // A hole in the side between rings 8 and 9, from which a branch goes on along +x.
    let hole = [rings[8][0], rings[9][0], rings[9][3], rings[8][3]];
    let center: Vec3 = hole
        .iter()
        .map(|&v| b.model.positions[v as usize])
        .sum::<Vec3>()
        / 4.0;
    let mut below = hole;
    for k in 1..=8 {
        let next = hole.map(|v| {
            let p = b.model.positions[v as usize];
            b.vertex(center + (p - center) * 0.5 + Vec3::X * 0.08 * k as f32)
        });
        for i in 0..4 {
            let j = (i + 1) % 4;
            b.triangle(BARK, [below[i], below[j], next[j]]);
            b.triangle(BARK, [below[i], next[j], next[i]]);
        }
        below = next;
    }
    for (level, pair) in rings.windows(2).enumerate() {
        for i in 0..4 {
            let j = (i + 1) % 4;
            if level == 8 && i == 3 {
                continue;
            }
            b.triangle(BARK, [pair[0][i], pair[0][j], pair[1][j]]);
            b.triangle(BARK, [pair[0][i], pair[1][j], pair[1][i]]);
        }
    }
    let tree = b.recognise();
    assert_eq!(tree.part_count, 1);
    assert_eq!(tree.skeleton.chains.len(), 2, "{:?}", tree.skeleton.chains);
    let end = |c: usize| {
        let nodes = &tree.skeleton.chains[c].nodes;
        tree.skeleton.nodes[nodes[nodes.len() - 1] as usize].position
    };
    assert!(
        end(0).abs_diff_eq(Vec3::Y, 0.06),
        "trunk ends at {}",
        end(0)
    );
    assert!(end(1).x > 0.6, "branch ends at {}", end(1));
}

#[test]
fn blades_that_share_a_point_are_leaves_of_their_own() {
    let mut b = Builder::new();
    for i in 0..17 {
        let turn = Quat::from_rotation_y(0.3 * i as f32);
        let corners = [
            Vec3::ZERO,
            Vec3::new(0.5, 0.1, -0.05),
            Vec3::new(0.5, 0.1, 0.05),
        ];
        let v = corners.map(|p| b.vertex(turn * p));
        b.triangle(LEAF, v);
    }
    let tree = b.recognise();
    assert_eq!(tree.leaves.len(), 17);
    assert_eq!(tree.leaf_classes.len(), 1);
}

#[test]
fn crossed_quads_are_one_leaf_and_halves_of_a_polygon_too() {
    let mut crossed = Builder::new();
    let mut halves = Builder::new();
    for i in 0..10 {
        let foot = Vec3::new(0.2 * i as f32 - 1.0, 0.0, 0.0);
        crossed.quad(foot, Vec3::Y * 0.1, Vec3::X * 0.03);
        crossed.quad(foot, Vec3::Y * 0.1, Vec3::Z * 0.03);
        halves.quad(foot, Vec3::Y * 0.1, Vec3::X * 0.03);
        halves.quad(foot + Vec3::X * 0.06, Vec3::Y * 0.1, Vec3::X * 0.03);
    }
    for builder in [crossed, halves] {
        let tree = builder.recognise();
        assert_eq!(tree.leaves.len(), 10);
        assert_eq!(tree.leaf_classes.len(), 1);
        assert!(tree.leaves.iter().all(|l| l.triangles.len() == 4));
    }
}

#[test]
fn scaled_and_turned_leaves_are_congruent_and_others_are_not() {
    let mut b = Builder::new();
    for i in 0..12 {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, i as f32, 2.0 * i as f32, 0.7);
        let scale = 1.0 + 0.2 * i as f32;
        let foot = Vec3::new(0.15 * i as f32 - 1.0, 0.0, 0.0);
        b.quad(
            foot,
            turn * Vec3::Y * 0.05 * scale,
            turn * Vec3::X * 0.01 * scale,
        );
    }
    b.quad(Vec3::Y, Vec3::Y * 0.05, Vec3::X * 0.02);
    let tree = b.recognise();
    assert_eq!(tree.leaf_classes.len(), 2);
    assert_eq!(tree.leaf_classes[0].count, 12);
}

#[test]
fn one_material_for_all_and_rules() {
    let mut b = small_tree();
    b.model.triangle_object.fill(BARK);
    let tree = b.recognise();
    assert_eq!(tree.leaves.len(), 16);
    assert_eq!(tree.skeleton.chains.len(), 4);

    b.model.materials[0].name = "Everything".to_owned();
    let rule = |name: &str, organ| RecogniseOptions {
        organs: vec![OrganRule {
            name_contains: name.to_owned(),
            organ,
        }],
    };
    let leaves = recognise(b.model.clone(), &rule("every", Organ::Foliage)).unwrap();
    assert!(leaves.organ.iter().all(|&o| o == Organ::Foliage));
    assert!(leaves.skeleton.nodes.is_empty());
    let missed = recognise(b.model.clone(), &rule("nothing", Organ::Wood)).unwrap();
    assert!(missed.warnings.iter().any(|w| w.contains("nothing")));
}

/// Needles as closed prisms beside a trunk are foliage, since there are many alike.
#[test]
fn prisms_are_needles() {
    let mut b = Builder::new();
    b.tube(BARK, &trunk());
    for i in 0..100 {
        let foot = Vec3::new(0.05, -0.8 + 0.015 * i as f32, 0.0);
        let turn = Quat::from_rotation_y(i as f32);
        b.tube(
            LEAF,
            &straight(
                turn * foot,
                turn * (foot + Vec3::X * 0.05),
                [0.002, 0.001],
                1,
            ),
        );
    }
    let tree = b.recognise();
    assert_eq!(tree.leaves.len(), 100);
    assert_eq!(tree.skeleton.chains.len(), 1);
}

#[test]
fn harmful_models_do_no_harm() {
    let mut one_leaf = Builder::new();
    one_leaf.quad(Vec3::ZERO, Vec3::Y, Vec3::X * 0.1);
    let tree = one_leaf.recognise();
    assert_eq!((tree.leaves.len(), tree.subtrees.len()), (1, 1));
    assert!(tree.warnings.iter().any(|w| w.contains("no wood")));

    let mut alone = Builder::new();
    alone.tube(BARK, &trunk());
    let tree = alone.recognise();
    assert_eq!((tree.skeleton.chains.len(), tree.subtrees.len()), (1, 2));

    let mut point = Builder::new();
    for _ in 0..1000 {
        let v = [0; 3].map(|_| point.vertex(Vec3::ZERO));
        point.triangle(LEAF, v);
        let v = [0; 3].map(|_| point.vertex(Vec3::ZERO));
        point.triangle(BARK, v);
    }
    let tree = point.recognise();
    assert!(!tree.subtrees.is_empty());

    assert!(recognise(Builder::new().model, &RecogniseOptions::default()).is_err());
}

#[test]
fn coincident_leaves_and_branches() {
    let mut b = Builder::new();
    for _ in 0..50 {
        b.tube(BARK, &trunk());
        b.quad(Vec3::ZERO, Vec3::Y * 0.1, Vec3::X * 0.02);
    }
    let tree = b.recognise();
    // Circles of parents are opened: every chain ends at a stem.
    for chain in &tree.skeleton.chains {
        assert!(
            chain
                .parent
                .is_none_or(|p| tree.skeleton.chains[p as usize].order < chain.order)
        );
    }
}

#[test]
fn many_single_triangles_in_little_time() {
    let mut b = Builder::new();
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    for _ in 0..300_000 {
        let p = Vec3::new(next(), next(), next());
        let [a, c] = [0, 1].map(|_| Vec3::new(next(), next(), next()) * 0.01);
        let v = [p, p + a, p + c].map(|p| b.vertex(p));
        b.triangle(LEAF, v);
    }
    let start = std::time::Instant::now();
    let tree = b.recognise();
    assert_eq!(tree.leaves.len(), 300_000);
    let seconds = start.elapsed().as_secs_f64();
    println!("300,000 triangles in {seconds:.2} s");
    assert!(seconds < 60.0);
}
