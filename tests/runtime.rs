//! What the run time promises on whole trees and forests, on random hierarchies.

use glam::{IVec3, Vec2, Vec3};
use pleach::runtime::{
    ActiveCut, Cells, Density, DotProduct, Drawn, Forest, Form, Hidden, Hierarchy, Law, Occlusion,
    Place, Plain, Subtree, View, Visibility,
};

/// Numbers from 0 to 1, the same on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as f32) / (1u64 << 31) as f32
    }

    fn direction(&mut self) -> Vec3 {
        Vec3::new(self.next() - 0.5, self.next() - 0.5, self.next() - 0.5).normalize_or(Vec3::X)
    }
}

/// A tree of about 10 m with three orders of branches, 2000 leaves.
fn species(seed: u64) -> Hierarchy {
    let mut random = Random(seed);
    let mut list = vec![Subtree {
        center: Vec3::Y * 5.0,
        radius: 6.0,
        switch_distance: 80.0,
        ..Subtree::default()
    }];
    for first in 0..12 {
        let branch = (random.direction() * Vec3::new(1.0, 0.3, 1.0)).normalize_or(Vec3::X);
        let parent = list.len() as u32;
        list.push(Subtree {
            parent: Some(0),
            center: Vec3::Y * (2.0 + 0.5 * first as f32) + branch * 2.0,
            radius: 2.0,
            switch_distance: 20.0 + 10.0 * random.next(),
            branch,
            density: random.next(),
            leaves: 3, // its own; those of its children are added below
            ..Subtree::default()
        });
        for _ in 0..(random.next() * 12.0) as u32 {
            let center = list[parent as usize].center + random.direction() * 1.5;
            let leaves = 1 + (random.next() * 30.0) as u32;
            list[parent as usize].leaves += leaves;
            let (branch, density) = (list[parent as usize].branch, list[parent as usize].density);
            list.push(Subtree {
                parent: Some(parent),
                center,
                radius: 0.5,
                switch_distance: 4.0 + 4.0 * random.next(),
                branch,
                density,
                leaves,
                ..Subtree::default()
            });
        }
    }
    list[0].leaves = 5 + list
        .iter()
        .filter(|s| s.parent == Some(0))
        .map(|s| s.leaves)
        .sum::<u32>();
    Hierarchy::new(&list).unwrap()
}

fn places(count: usize, spacing: f32, species: u32) -> Vec<Place> {
    let side = (count as f32).sqrt().ceil() as usize;
    let mut random = Random(99);
    (0..count)
        .map(|i| Place {
            position: Vec3::new((i % side) as f32, 0.0, (i / side) as f32) * spacing
                + Vec3::new(random.next(), 0.0, random.next()) * spacing,
            turn: Vec2::from_angle(random.next() * std::f32::consts::TAU),
            scale: 0.7 + 0.6 * random.next(),
            species: (random.next() * species as f32) as u32,
        })
        .collect()
}

/// A walk with slow and fast steps, a jump, and turns of the head.
fn path(frames: usize) -> Vec<View> {
    let mut random = Random(5);
    let mut eye = Vec3::new(5.0, 1.7, 5.0);
    (0..frames)
        .map(|frame| {
            let step = if frame % 40 < 20 { 0.03 } else { 0.8 };
            eye += random.direction() * Vec3::new(1.0, 0.2, 1.0) * step + Vec3::X * 0.3 * step;
            if frame % 97 == 96 {
                eye = Vec3::new(
                    random.next() * 60.0,
                    10.0 * random.next(),
                    random.next() * 60.0,
                );
            }
            View::looking(eye, random.direction(), 1.0, 1.7)
        })
        .collect()
}

/// A grid over the forest with a few solid cells and many half-empty ones.
fn cells() -> Cells {
    let mut random = Random(3);
    let mut cells = Cells::new(Vec3::splat(-2.0), Vec3::new(70.0, 16.0, 70.0), [18, 4, 18]);
    for i in 0..18 * 4 * 18 {
        let solid = random.next();
        cells.set(
            IVec3::new(i % 18, i / 18 % 4, i / 72),
            if solid > 0.97 { 1.0 } else { 0.3 * solid },
        );
    }
    cells
}

/// How often each leaf of a tree is drawn, nodes that fade in over others not counted.
fn times_covered(hierarchy: &Hierarchy, drawn: &[Drawn]) -> Vec<u32> {
    let tips: Vec<u32> = (0..hierarchy.nodes().len() as u32)
        .filter(|&n| hierarchy.is_tip(n))
        .collect();
    let covers =
        |d: &Drawn, tip: u32| (d.node..hierarchy.nodes()[d.node as usize].end).contains(&tip);
    let whole = |d: &&Drawn| d.fade >= 1.0;
    tips.iter()
        .map(|&tip| {
            drawn
                .iter()
                .filter(whole)
                .filter(|d| covers(d, tip))
                .count() as u32
        })
        .collect()
}

#[test]
fn every_leaf_is_under_exactly_one_drawn_node_in_every_frame() {
    let hierarchy = species(1);
    let leaves: u32 = (0..hierarchy.nodes().len())
        .filter(|&n| hierarchy.is_tip(n as u32))
        .map(|n| hierarchy.origins()[n].leaves)
        .sum();
    assert_eq!(
        leaves,
        hierarchy.origins()[0].leaves,
        "tips carry every leaf once"
    );
    let cells = cells();
    let mut cut = ActiveCut::new(
        hierarchy.clone(),
        Place::at(Vec3::new(8.0, 0.0, 8.0)),
        Hidden::new(Density::default(), Occlusion::new(&cells, Law::Beer)),
    );
    cut.fade = 0.0;
    let (mut drawn, mut sizes) = (Vec::new(), std::collections::BTreeSet::new());
    for view in path(300) {
        cut.update(&view);
        drawn.clear();
        cut.collect(&view, &mut drawn);
        assert!(times_covered(&hierarchy, &drawn).iter().all(|&n| n == 1));
        sizes.insert(drawn.len());
    }
    assert!(
        sizes.len() > 4 && sizes.contains(&1),
        "the path sees many cuts: {sizes:?}"
    );
}

/// Follows a path through a forest and makes each cut anew beside it.
fn follows<V: Visibility + Clone>(visibility: V) {
    let all = vec![species(1), species(2)];
    let places = places(100, 6.0, 2);
    let mut following = Forest::new(all.clone(), &places, visibility.clone());
    let (mut a, mut b) = (Vec::new(), Vec::new());
    let (mut splits, mut merges, mut looked_at, mut nodes) = (0, 0, 0u64, 0u64);
    for view in path(250) {
        let changes = following.update(&view);
        splits += changes.splits;
        merges += changes.merges;
        looked_at += u64::from(changes.looked_at);
        let mut anew = Forest::new(all.clone(), &places, visibility.clone());
        nodes += u64::from(anew.update(&view).looked_at);
        a.clear();
        b.clear();
        following.collect(&view, &mut a);
        anew.collect(&view, &mut b);
        assert!(a == b, "{} and {} drawn", a.len(), b.len());
    }
    assert!(
        splits > 1000 && merges > 1000,
        "{splits} splits, {merges} merges"
    );
    assert!(
        looked_at * 3 < nodes * 2,
        "{looked_at} looks at {nodes} nodes"
    );
}

#[test]
fn a_cut_that_follows_is_the_cut_made_anew() {
    follows(Plain);
    follows(Density::default());
    follows(DotProduct { strength: 2.0 });
}

#[test]
fn so_it_is_where_cells_hide_what_is_behind() {
    let cells = cells();
    for law in [Law::Beer, Law::Equation4] {
        follows(Hidden::new(Density::default(), Occlusion::new(&cells, law)));
    }
    let hidden = Hidden::new(Plain, Occlusion::new(&cells, Law::Beer));
    follows(hidden.expecting(3e-3));
}

#[test]
fn trees_outside_the_picture_wait_until_another_picture_asks_for_them() {
    let (all, places) = (vec![species(1), species(2)], places(400, 6.0, 2));
    let new = || Forest::new(all.clone(), &places, Density::default());
    let (mut lazy, mut again) = (new(), new());
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for view in path(60) {
        // A shadow's picture, from elsewhere; cuts are for the eye.
        let shadow = View::looking(
            view.eye + Vec3::Y * 40.0,
            Vec3::new(0.3, -1.0, 0.1),
            1.2,
            1.0,
        );
        let seen = lazy.update(&view).looked_at;
        a.clear();
        lazy.collect(&shadow, &mut a);
        let mut anew = new();
        let all_of_them = View {
            half: Vec2::splat(1e6),
            ..view
        };
        let looked_at = anew.update(&all_of_them).looked_at;
        assert!(looked_at > seen, "{looked_at} {seen}");
        b.clear();
        anew.collect(&shadow, &mut b);
        assert!(a == b, "{} and {} drawn", a.len(), b.len());
        assert!(!a.is_empty());
        // The eye's own picture after the shadow's: neither is the other's.
        for (forest, out) in [(&mut lazy, &mut a), (&mut anew, &mut b)] {
            out.clear();
            forest.collect(&view, out);
        }
        let mut own = new();
        own.update(&view);
        let mut c = Vec::new();
        own.collect(&view, &mut c);
        assert!(
            a == c && b == c,
            "{} {} {} drawn",
            a.len(),
            b.len(),
            c.len()
        );
        // The head turns where the eye is: what comes into the picture is cut then.
        let turned = View::looking(view.eye, -view.forward, 1.0, 1.7);
        for forest in [&mut lazy, &mut again] {
            forest.update(&turned);
        }
        a.clear();
        b.clear();
        lazy.collect(&turned, &mut a);
        again.collect(&turned, &mut b);
        assert!(a == b, "{} and {} drawn", a.len(), b.len());
    }
}

#[test]
fn splits_and_merges_are_counted() {
    let whole = Subtree {
        leaves: 2,
        switch_distance: 50.0,
        ..Subtree::default()
    };
    let half = |x| Subtree {
        parent: Some(0),
        leaves: 1,
        center: Vec3::X * x,
        switch_distance: 5.0,
        ..Subtree::default()
    };
    let hierarchy = Hierarchy::new(&[whole, half(1.0), half(-1.0)]).unwrap();
    let mut cut = ActiveCut::new(hierarchy, Place::at(Vec3::ZERO), Plain);
    let mut at = |x: f32| {
        let changes = cut.update(&View::looking(Vec3::X * x, Vec3::NEG_X, 1.0, 1.0));
        (changes.splits, changes.merges)
    };
    assert_eq!(at(100.0), (0, 0));
    assert_eq!(at(40.0), (1, 0)); // the whole into halves
    assert_eq!(at(5.5), (1, 0)); // the nearer half into its geometry
    assert_eq!(at(0.0), (1, 0)); // the other too
    assert_eq!(at(100.0), (0, 3)); // all of it back
}

#[test]
fn children_are_drawn_until_their_parent_has_faded_in() {
    let whole = Subtree {
        leaves: 2,
        switch_distance: 50.0,
        ..Subtree::default()
    };
    let half = |x| Subtree {
        parent: Some(0),
        leaves: 1,
        center: Vec3::X * x,
        ..Subtree::default()
    };
    let hierarchy = Hierarchy::new(&[whole, half(1.0), half(-1.0)]).unwrap();
    let mut cut = ActiveCut::new(hierarchy, Place::at(Vec3::ZERO), Plain);
    cut.fade = 0.2;
    let mut fades = |x: f32| -> Vec<(u32, f32)> {
        let view = View::looking(Vec3::X * x, Vec3::NEG_X, 1.0, 1.0);
        cut.update(&view);
        let mut drawn = Vec::new();
        cut.collect(&view, &mut drawn);
        drawn
            .iter()
            .map(|d| (d.node, (d.fade * 100.0).round() / 100.0))
            .collect()
    };
    assert_eq!(fades(60.0), [(0, 1.0)]);
    assert_eq!(fades(45.0), [(1, 1.0), (2, 1.0), (0, 0.5)]);
    assert_eq!(fades(40.1), [(1, 1.0), (2, 1.0), (0, 0.01)]);
    assert_eq!(fades(39.0), [(1, 1.0), (2, 1.0)]);
}

#[test]
fn a_sparse_crown_is_as_visible_from_behind_as_from_the_front() {
    let list = |density: f32| {
        let whole = Subtree {
            leaves: 2,
            switch_distance: 50.0,
            ..Subtree::default()
        };
        let side = |x: f32| Subtree {
            parent: Some(0),
            leaves: 1,
            center: Vec3::X * x,
            switch_distance: 15.0,
            branch: Vec3::X * x.signum(),
            density,
            ..Subtree::default()
        };
        Hierarchy::new(&[whole, side(2.0), side(-2.0)]).unwrap()
    };
    let geometry = |density: f32| {
        let mut cut = ActiveCut::new(
            list(density),
            Place::at(Vec3::ZERO),
            Density { strength: 1.0 },
        );
        cut.fade = 0.0;
        let view = View::looking(Vec3::X * 10.0, Vec3::NEG_X, 1.0, 1.0);
        cut.update(&view);
        let mut drawn = Vec::new();
        cut.collect(&view, &mut drawn);
        drawn
            .iter()
            .map(|d| d.form == Form::Geometry)
            .collect::<Vec<_>>()
    };
    assert_eq!(geometry(0.0), [true, true]); // Fig. 1(a): the rear branch in full
    assert_eq!(geometry(1.0), [true, false]); // a dense crown hides it
}

#[test]
fn cameras_inside_at_infinity_and_without_a_field_of_view_have_an_answer() {
    let places = places(25, 6.0, 1);
    let inside = View::looking(places[3].position + Vec3::Y * 5.0, Vec3::X, 1.0, 1.0);
    let blind = [
        View {
            eye: Vec3::INFINITY,
            ..inside
        },
        View {
            eye: Vec3::splat(f32::NAN),
            ..inside
        },
        View::looking(inside.eye, Vec3::X, 0.0, 1.0),
        View {
            zoom: f32::NAN,
            ..inside
        },
    ];
    let cells = cells();
    let mut forest = Forest::new(
        vec![species(1)],
        &places,
        Hidden::new(Density::default(), Occlusion::new(&cells, Law::Beer)),
    );
    let mut first = Vec::new();
    forest.update(&inside);
    forest.collect(&inside, &mut first);
    assert!(
        first
            .iter()
            .any(|d| d.tree == 3 && d.form == Form::Geometry)
    );
    for view in blind {
        assert_eq!(forest.update(&view).splits, 0);
        let mut drawn = Vec::new();
        forest.collect(&view, &mut drawn);
        assert!(drawn.is_empty());
        forest.update(&inside);
        forest.collect(&inside, &mut drawn);
        assert_eq!(drawn, first);
    }
}

#[test]
fn very_far_away_every_tree_is_one_billboard() {
    let places = places(25, 6.0, 1);
    let mut forest = Forest::new(vec![species(1)], &places, Density::default());
    let view = View::looking(Vec3::new(-1e7, 0.0, 0.0), Vec3::X, 1.0, 1.0);
    let mut drawn = Vec::new();
    forest.update(&view);
    forest.collect(&view, &mut drawn);
    assert_eq!(drawn.len(), 25);
    assert!(
        drawn
            .iter()
            .all(|d| d.node == 0 && d.form == Form::Billboard)
    );
}

#[test]
fn a_double_zoom_is_half_the_distance() {
    let mut drawn = [Vec::new(), Vec::new()];
    for (zoom, out) in [1.0, 2.0].into_iter().zip(&mut drawn) {
        let mut cut = ActiveCut::new(species(4), Place::at(Vec3::ZERO), Plain);
        cut.fade = 0.0;
        let eye = Vec3::new(30.0, 5.0, 0.0) * zoom;
        let view = View {
            zoom,
            ..View::looking(eye, Vec3::NEG_X, 1.0, 1.0)
        };
        cut.update(&view);
        cut.collect(&view, out);
    }
    // Not twice the same, since sub-trees keep their places; about the same number.
    let [a, b] = drawn.map(|d| d.len() as f32);
    assert!((a / b - 1.0).abs() < 0.5, "{a} and {b}");
}

#[test]
fn no_frame_allocates_after_the_path_was_walked_from_start_to_start() {
    let cells = cells();
    let mut forest = Forest::new(
        vec![species(1), species(2)],
        &places(200, 6.0, 2),
        Hidden::new(Density::default(), Occlusion::new(&cells, Law::Beer)),
    );
    let mut spender = pleach::runtime::Spender::default();
    let items: Vec<pleach::runtime::Item> = (0..500)
        .map(|i| pleach::runtime::Item {
            center: Vec3::X * i as f32,
            normal: Vec3::X,
            leaves: 1,
        })
        .collect();
    let (views, mut drawn) = (path(200), Vec::new());
    let mut walk = || {
        for view in &views {
            drawn.clear();
            forest.update(view);
            forest.collect(view, &mut drawn);
            let by = |i: usize| pleach::runtime::by_distance(&items[i], view.eye);
            spender.spend(&items, 100, by);
            spender.spend_layers(&items, 100, (view.eye, view.forward), 8, by);
        }
    };
    let warm_up = allocation_counter::measure(&mut walk);
    assert!(warm_up.count_total > 0, "the counter counts");
    // Trees outside the picture wait: another walk begins with the cuts that the first one left.
    walk();
    let second = allocation_counter::measure(&mut walk);
    assert_eq!(second.count_total, 0);
}
