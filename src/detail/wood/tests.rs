//! Hand-made chains: cylinders and cones whose surfaces and bends are known.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::curve::polygon_deviation;
use super::*;
use crate::botany::Model;
use crate::botany::model::{Material, Object};
use crate::botany::tree::{Chain, Node, Skeleton};

/// A tube of `sides` corners through `line` (position, radius), bark once around and 3 a length.
fn add_tube(tree: &mut Tree, line: &[(Vec3, f32)], sides: u32, parent: Option<(u32, u32)>) {
    let model = &mut tree.model;
    if model.materials.is_empty() {
        model.materials.push(Material::default());
        model.objects.push(Object::default());
    }
    let chain = tree.skeleton.chains.len() as u32;
    let (first, base) = (
        model.positions.len() as u32,
        tree.skeleton.nodes.len() as u32,
    );
    let forward = (line[line.len() - 1].0 - line[0].0).normalize();
    let x = forward.any_orthonormal_vector();
    let y = forward.cross(x);
    let mut along = 0.0;
    for (j, &(center, radius)) in line.iter().enumerate() {
        along += if j > 0 {
            center.distance(line[j - 1].0)
        } else {
            0.0
        };
        for i in 0..=sides {
            let turn = i as f32 / sides as f32;
            let out = x * (TAU * turn).cos() + y * (TAU * turn).sin();
            model.positions.push(center + out * radius);
            model.normals.push(out);
            model.uvs[0].push(Vec2::new(turn, 3.0 * along));
        }
        tree.skeleton.nodes.push(Node {
            position: center,
            radius,
            parent: match j {
                0 => parent.map_or(NO_NODE, |p| p.1),
                _ => base + j as u32 - 1,
            },
            chain,
        });
    }
    for j in 0..line.len() as u32 - 1 {
        for i in 0..sides {
            let a = first + j * (sides + 1) + i;
            let c = a + sides + 1;
            for triangle in [[a, a + 1, c], [a + 1, c + 1, c]] {
                model.triangles.push(triangle);
                model.triangle_object.push(0);
                tree.organ.push(Organ::Wood);
                tree.wood_node.push(base + j);
            }
        }
    }
    tree.skeleton.chains.push(Chain {
        nodes: (base..base + line.len() as u32).collect(),
        parent: parent.map(|p| p.0),
        order: 0,
    });
}

fn tree_of(line: &[(Vec3, f32)], sides: u32) -> Tree {
    let mut tree = Tree {
        model: Model::default(),
        skeleton: Skeleton::default(),
        ..Tree::default()
    };
    add_tube(&mut tree, line, sides, None);
    tree
}

/// Up along y with radii from `r0` to `r1`, `bend` sideways in the middle.
fn line(nodes: u32, r0: f32, r1: f32, bend: f32) -> Vec<(Vec3, f32)> {
    let at = |i: u32| {
        let t = i as f32 / (nodes - 1) as f32;
        let side = bend * 4.0 * t * (1.0 - t);
        (Vec3::new(side, t, 0.0), r0 + (r1 - r0) * t)
    };
    (0..nodes).map(at).collect()
}

fn mesh_surface(mesh: &WoodMesh) -> f64 {
    let corner = |i: u32| mesh.positions[i as usize].as_dvec3();
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(c - a).length() / 2.0
        })
        .sum()
}

fn build(wood: &Wood, option: usize) -> WoodMesh {
    let mut mesh = WoodMesh::default();
    wood.build_tube(0, option, 1.0, &mut mesh);
    mesh
}

#[test]
fn polygon_deviation_is_that_of_a_numeric_mean() {
    for sides in [3, 4, 8] {
        let x = std::f64::consts::PI / f64::from(sides);
        let apothem = x / x.tan();
        let steps = 100_000;
        let mean: f64 = (0..steps)
            .map(|i| (f64::from(i) + 0.5) / f64::from(steps) * x)
            .map(|a| (apothem / a.cos() - 1.0).powi(2))
            .sum::<f64>()
            / f64::from(steps);
        assert!((polygon_deviation(sides) - mean).abs() < 1e-8, "{sides}");
    }
}

#[test]
fn every_option_has_the_surface_and_triangles_that_it_states() {
    for double_sided in [true, false] {
        let tree = tree_of(&line(12, 0.03, 0.01, 0.1), 12);
        let wood = Wood::new(&tree, double_sided);
        let options = &wood.tube_options(0).options;
        assert!(options.len() > 5, "{options:?}");
        for (i, option) in options.iter().enumerate() {
            let mesh = build(&wood, i);
            assert_eq!(mesh.triangles.len(), option.triangles as usize);
            assert_eq!(mesh.triangle_material.len(), mesh.triangles.len());
            let faces = match &option.shape {
                Shape::Tube {
                    sides: 2,
                    two_faces: false,
                    ..
                } => 2.0,
                _ => 1.0,
            };
            let ratio = mesh_surface(&mesh) * faces / wood.area(0);
            assert!((ratio - 1.0).abs() < 2e-3, "{:?}: {ratio}", option.shape);
        }
    }
}

#[test]
fn a_three_sided_tube_has_the_projected_width_of_its_cylinder() {
    let tree = tree_of(&line(2, 0.05, 0.05, 0.0), 64);
    let wood = Wood::new(&tree, true);
    let options = &wood.tube_options(0).options;
    let open = options.iter().position(
        |o| matches!(&o.shape, Shape::Tube { sides: 3, rings, .. } if rings[1].radius > 0.0),
    );
    let mesh = build(&wood, open.expect("a three-sided prism"));
    let mut mean = 0.0;
    for step in 0..360 {
        let (sin, cos) = (step as f32).to_radians().sin_cos();
        let across = mesh.positions.iter().map(|p| p.x * cos + p.z * sin);
        let (low, high) = across.fold((f32::MAX, f32::MIN), |(l, h), a| (l.min(a), h.max(a)));
        mean += f64::from(high - low) / 360.0;
    }
    assert!((mean - 0.1).abs() < 2e-4, "mean projected width {mean}");
}

#[test]
fn a_straight_taper_needs_one_segment() {
    let tree = tree_of(&line(20, 0.03, 0.01, 0.0), 8);
    let path = Path::new(&tree, 0, &[0], &node_slots(&tree), 1.0).expect("a path");
    let samples = rings::samples(&path);
    let straight = fit::fit(&path, &samples, &[0, 19], false);
    assert!(straight.displacement < 1e-10, "{}", straight.displacement);
    // All tubes of the curve have one segment: more rings gain nothing.
    for option in &Wood::new(&tree, true).tube_options(0).options {
        if let Shape::Tube { rings, .. } = &option.shape {
            assert_eq!(rings.len(), 2);
        }
    }
}

#[test]
fn a_rod_becomes_a_ribbon_and_a_cone_a_spike() {
    let flat = |r0: f32, r1: f32| -> Vec<(u32, f64)> {
        let tree = tree_of(&line(60, r0, r1, 0.0), 8);
        let options = Wood::new(&tree, true).tube_options(0).options.clone();
        let flat = options.iter().filter(|o| !o.is_round());
        flat.map(|o| (o.triangles, o.error)).collect()
    };
    // Of the best spike for a rod of radius r the radius is 1.5 r at the foot: its mean squared error is r^2 / 4, which
    // weighs nine times, and a ribbon's deviation from a circle is r^2 for both.
    let rod = flat(0.02, 0.02);
    let [(1, spike), (2, ribbon)] = rod[..] else {
        panic!("{rod:?}");
    };
    assert!((spike / ribbon - 3.25).abs() < 0.05, "{}", spike / ribbon);
    let cone = flat(0.02, 0.0);
    assert!(matches!(cone[..], [(1, _)]), "{cone:?}");
}

#[test]
fn least_squares_beat_chords_sixfold_on_a_parabola() {
    // Sagitta h: the chord's mean squared deviation is 8/15 h^2; with the foot pinned the best
    // line through it has 2/15 h^2 less the share that its free end gains.
    let tree = tree_of(&line(33, 0.01, 0.01, 0.05), 8);
    let path = Path::new(&tree, 0, &[], &node_slots(&tree), 1.0).expect("a path");
    let samples = rings::samples(&path);
    let error = |knots: &[u32]| fit::fit(&path, &samples, knots, false).displacement;
    let chord = 8.0 / 15.0 * 0.05f64.powi(2);
    assert!(error(&[0, 32]) < 0.5 * chord, "{} {chord}", error(&[0, 32]));
    assert!(error(&[0, 8, 16, 24, 32]) < chord / 256.0 / 3.0);
}

#[test]
fn curves_are_convex_and_monotone() {
    let tree = tree_of(&line(40, 0.03, 0.002, 0.2), 10);
    let wood = Wood::new(&tree, true);
    let options = &wood.tube_options(0).options;
    assert!(options.len() <= 12 && options.len() >= 6);
    let slopes: Vec<_> = options
        .windows(2)
        .map(|p| (p[0].error - p[1].error) / f64::from(p[1].triangles - p[0].triangles))
        .collect();
    assert!(slopes.iter().all(|&s| s > 0.0), "{slopes:?}");
    assert!(slopes.windows(2).all(|s| s[0] > s[1]), "{slopes:?}");
    assert_eq!(options[0].triangles, 1);
    assert_eq!(options[options.len() - 1].shape, Shape::Original);
}

#[test]
fn bark_goes_on_as_on_the_original() {
    let tree = tree_of(&line(12, 0.05, 0.03, 0.02), 12);
    let wood = Wood::new(&tree, true);
    for (i, option) in wood.tube_options(0).options.iter().enumerate() {
        let Shape::Tube { sides, .. } = option.shape else {
            continue;
        };
        let mesh = build(&wood, i);
        for (position, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            assert!((uv.y - 3.0 * position.y).abs() < 0.1, "{position} {uv}");
        }
        for [a, b, c] in &mesh.triangles {
            let u = [a, b, c].map(|&v| mesh.uvs[v as usize].x);
            let span = u.iter().fold(0.0f32, |s, x| s.max((x - u[0]).abs()));
            assert!(span < 1.0 / sides as f32 + 1e-4, "a seam is torn: {u:?}");
        }
    }
}

#[test]
fn normals_look_out_and_faces_wind_with_them() {
    let tree = tree_of(&line(12, 0.05, 0.01, 0.05), 12);
    for double_sided in [true, false] {
        let wood = Wood::new(&tree, double_sided);
        for i in 0..wood.tube_options(0).options.len() {
            let mesh = build(&wood, i);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                let face = (b - a).cross(c - a).normalize();
                for v in t {
                    let normal = mesh.normals[*v as usize];
                    assert!((normal.length() - 1.0).abs() < 1e-4);
                    assert!(
                        face.dot(normal) > 0.2,
                        "{:?}",
                        wood.tube_options(0).options[i]
                    );
                }
            }
        }
    }
}

#[test]
fn a_side_branch_starts_inside_its_carrier() {
    let mut tree = tree_of(&line(6, 0.1, 0.1, 0.0), 8);
    // The tube floats a little outside the trunk's bark.
    let twig = [0.12, 0.3, 0.5].map(|x| (Vec3::new(x, 0.6, 0.0), 0.01));
    add_tube(&mut tree, &twig, 6, Some((0, 3)));
    let wood = Wood::new(&tree, true);
    for option in 1..wood.tube_options(1).options.len() - 1 {
        let mut mesh = WoodMesh::default();
        wood.build_tube(1, option, 1.0, &mut mesh);
        let foot = mesh.positions.iter().map(|p| p.x).fold(f32::MAX, f32::min);
        assert!(foot < 0.06, "foot at {foot}");
    }
}

#[test]
fn a_rod_that_stands_free_of_what_the_skeleton_joins_it_to_stays_where_it_is() {
    // Across, and one that stands a third of the way along but is joined to the far end.
    let across: Vec<_> = (0..9).map(|i| (Vec3::X * i as f32 / 8.0, 0.01)).collect();
    let upright = [
        (Vec3::new(0.3, 0.0, 0.0), 0.01),
        (Vec3::new(0.3, 1.0, 0.0), 0.01),
    ];
    let mut tree = tree_of(&across, 8);
    add_tube(&mut tree, &upright, 8, Some((0, 8)));
    let wood = Wood::new(&tree, true);
    let mut mesh = WoodMesh::default();
    wood.build_tube(1, 1, 1.0, &mut mesh);
    assert!(!mesh.positions.is_empty());
    for p in &mesh.positions {
        assert!((p.x - 0.3).abs() < 0.05, "{p}");
    }
}

#[test]
fn degenerate_chains_have_an_answer() {
    // One node without a parent; two coincident nodes; zero radius; no triangles.
    let mut tree = tree_of(&line(4, 0.0, 0.0, 0.0), 6);
    add_tube(&mut tree, &line(5, 0.02, 0.0, 0.0), 6, None);
    for nodes in [
        vec![Vec3::ZERO],
        vec![Vec3::ONE; 2],
        vec![Vec3::ZERO, Vec3::Y],
    ] {
        let chain = tree.skeleton.chains.len() as u32;
        let first = tree.skeleton.nodes.len() as u32;
        tree.skeleton.chains.push(Chain {
            nodes: (first..first + nodes.len() as u32).collect(),
            parent: None,
            order: 0,
        });
        for position in nodes {
            tree.skeleton.nodes.push(Node {
                position,
                radius: 0.0,
                parent: NO_NODE,
                chain,
            });
        }
    }
    let wood = Wood::new(&tree, true);
    assert_eq!(wood.len(), 5);
    for chain in 0..wood.len() as u32 {
        let options = &wood.tube_options(chain).options;
        assert!(!options.is_empty(), "chain {chain}");
        for (option, stated) in options.iter().enumerate() {
            let mut mesh = WoodMesh::default();
            wood.build_tube(chain, option, 1.2, &mut mesh);
            assert_eq!(mesh.triangles.len(), stated.triangles as usize);
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
            assert!(mesh.normals.iter().all(|n| n.is_finite()));
        }
    }
}

/// A trunk of 30 nodes with 20 twigs of 10, spread along it.
fn twiggy() -> Tree {
    let mut tree = tree_of(&line(30, 0.05, 0.02, 0.0), 10);
    for i in 0..20 {
        let foot = Vec3::new(0.0, (i + 5) as f32 / 29.0, 0.0);
        let twig: Vec<_> = line(10, 0.01, 0.002, 0.1)
            .iter()
            .map(|&(p, r)| (foot + Vec3::new(0.3 * p.y, 0.1 * p.y, 0.2 * p.x), r))
            .collect();
        add_tube(&mut tree, &twig, 6, Some((0, i + 5)));
    }
    tree
}

fn cost(wood: &Wood, chosen: &[usize]) -> u64 {
    let each = chosen.iter().enumerate();
    each.map(|(c, &o)| u64::from(wood.tube_options(c as u32).options[o].triangles))
        .sum()
}

#[test]
fn a_budget_is_kept_and_used() {
    let tree = twiggy();
    let wood = Wood::new(&tree, true);
    for budget in [8, 21, 100, 500, 2000] {
        let total = cost(&wood, &wood.choose(budget));
        assert!(
            total <= budget && total as f64 > 0.7 * budget as f64,
            "{budget}: {total}"
        );
    }
    assert_eq!(wood.choose(500), Wood::new(&tree, true).choose(500));
}

#[test]
fn what_is_left_out_is_drawn_on_neighbours() {
    let tree = twiggy();
    let wood = Wood::new(&tree, false);
    let whole: f64 = (0..21).map(|c| wood.area(c)).sum();
    for budget in [2, 8, 20, 60] {
        let mut chosen: Vec<_> = wood.choose(budget).into_iter().map(Some).collect();
        wood.settle(&mut chosen);
        let mesh = wood.build(&chosen, 1.0);
        let options: Vec<_> = chosen.iter().map(|o| o.unwrap_or(0)).collect();
        assert_eq!(mesh.triangles.len() as u64, cost(&wood, &options));
        // What starts inside the trunk is drawn on top: a little more, never less.
        let ratio = mesh_surface(&mesh) / whole;
        assert!((0.99..1.25).contains(&ratio), "{budget}: {ratio}");
        let widening = wood.widening(&chosen);
        let absent =
            |c: usize| wood.tube_options(c as u32).options[options[c]].shape == Shape::Absent;
        let drawn: f64 = (0..21)
            .filter(|&c| !absent(c))
            .map(|c| wood.area(c as u32) * f64::from(widening[c]))
            .sum();
        assert!((drawn / whole - 1.0).abs() < 1e-5, "{drawn} of {whole}");
    }
}

#[test]
fn a_branch_never_floats() {
    let mut tree = twiggy();
    let twig = [0.2, 0.5, 0.9].map(|x| (Vec3::new(0.3, 0.5 + x, 0.4), 0.02));
    add_tube(&mut tree, &twig, 6, Some((3, 30 + 25)));
    let wood = Wood::new(&tree, true);
    let mut chosen = vec![Some(0); wood.len()];
    chosen[21] = Some(2);
    assert_eq!(wood.tube_options(3).options[0].shape, Shape::Absent);
    let added = wood.settle(&mut chosen);
    assert!(chosen[3] == Some(1) && added >= 1);
    assert_eq!(wood.settle(&mut chosen), 0, "settling settles");
}

#[test]
fn what_a_card_shows_neither_gives_nor_takes_area() {
    let tree = twiggy();
    let wood = Wood::new(&tree, true);
    let absent: Vec<_> = (0..21u32)
        .filter(|&c| wood.tube_options(c).options[0].shape == Shape::Absent)
        .collect();
    assert_eq!(absent.len(), 20, "all but the trunk");
    // Twig 1 is on a card; all others are left out: the trunk alone takes their area.
    let mut chosen = vec![Some(0); 21];
    chosen[1] = None;
    let trunk = (0..21).find(|c| !absent.contains(c)).expect("one stays") as usize;
    let widening = wood.widening(&chosen);
    let given: f64 = (0..21u32)
        .filter(|&c| c != 1 && c != trunk as u32)
        .map(|c| wood.area(c))
        .sum();
    let expected = 1.0 + given / wood.area(trunk as u32);
    assert!((f64::from(widening[trunk]) - expected).abs() < 1e-5);
    assert_eq!(widening[1], 1.0);
}
