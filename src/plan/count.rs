//! What one frame of the path draws.

use super::hidden::Hiding;
use super::kind::{Kind, Step};
use super::seen::Seen;
use super::spec::Spec;
use crate::runtime::View;

/// What a frame shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// For each kind and level, how many trees show it.
    pub shown: Vec<Vec<u64>>,
    /// For each kind the nearest and the farthest tree that is seen, metres at scale 1; the nearest
    /// is [`f64::MAX`] where none is.
    pub distances: Vec<[f64; 2]>,
    /// For each kind from where trees are seen that show a level.
    pub seen: Vec<Seen>,
    /// Triangles of all trees in view at the levels they show.
    level_triangles: u64,
    /// The same without levels.
    pub original_triangles: u64,
    /// Trees in view that others hide.
    pub hidden_trees: u64,
    /// Triangles where these are left out, and others take the level that their occlusion asks for.
    pub unhidden_triangles: u64,
}

/// Occlusion probability from which a tree counts as hidden.
const HIDDEN: f32 = 0.99;

impl Frame {
    /// Triangles that the frame draws.
    pub fn triangles(&self) -> u64 {
        self.level_triangles
    }
}

/// Counts what `view` shows of all trees, each at the level that its distance asks for.
pub fn frame(
    view: &View,
    kinds: &[Kind],
    ladders: &[Vec<Step>],
    spec: &Spec,
    hiding: &mut Hiding,
) -> Frame {
    let mut out = Frame::default();
    hiding.look_from(view.eye);
    for (kind, ladder) in kinds.iter().zip(ladders) {
        let mut shown = vec![0u64; ladder.len()];
        let mut reach = [f64::MAX, 0.0f64];
        let mut seen = Seen::default();
        let end_m = kind.end_m(&spec.scene);
        for spot in &kind.spots {
            let (center, radius) = kind.sphere(spot);
            if !view.meets(center, radius) {
                continue;
            }
            out.original_triangles += kind.triangles;
            // A tree twice as large looks as from half the distance.
            let distance = f64::from(center.distance(view.eye)) / f64::from(spot.scale);
            let distance = distance.max(spec.scene.nearest_m);
            if distance >= end_m {
                continue;
            }
            let at = |distance: f64| ladder.partition_point(|s| s.distance_m <= distance) - 1;
            let level = at(distance);
            shown[level] += 1;
            if level > 0 {
                let towards = (view.eye - center) / radius;
                let own = spot.turn.map(|turn| (turn * towards).normalize_or_zero());
                let own = own.map_or(towards, |direction| direction * towards.length());
                seen.add(own, spot.turn.is_none());
            }
            out.level_triangles += ladder[level].triangles;
            let hidden = hiding.probability(center, kind.height_m as f32 * spot.scale);
            if hidden >= HIDDEN {
                out.hidden_trees += 1;
            } else {
                // Equation 5 with detail as one over the distance.
                let blended = at(distance / f64::from(1.0 - hidden));
                out.unhidden_triangles += ladder[blended].triangles;
            }
            reach = [reach[0].min(distance), reach[1].max(distance)];
        }
        out.shown.push(shown);
        out.distances.push(reach);
        out.seen.push(seen);
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::super::places::Spot;
    use super::*;
    use crate::export::maps::Maps;
    use crate::runtime::Cells;
    use crate::scene::Scene;

    #[test]
    fn levels_are_counted_by_distance_and_scale_and_what_is_behind_is_not() {
        let spot = |z: f32, scale: f32| Spot {
            foot: Vec3::new(0.0, 0.0, z),
            scale,
            turn: Some(glam::Mat3::IDENTITY),
        };
        let kind = Kind {
            name: "t".into(),
            input: "t.glb".into(),
            triangles: 1000,
            texture_bytes: 0,
            file_bytes: 0,
            paints: Default::default(),
            maps: Maps::All,
            atlas: String::new(),
            height_m: 10.0,
            center: DVec3::ZERO,
            radius_m: 5.0,
            spots: vec![
                spot(-10.0, 1.0),
                spot(-50.0, 1.0),
                spot(-90.0, 2.0),
                spot(-90.0, 1.0),
                spot(-400.0, 1.0),
                spot(50.0, 1.0),
            ],
            cells: Cells::new(Vec3::splat(-1.0), Vec3::ONE, [1; 3]),
        };
        let step = |distance_m, triangles| Step {
            distance_m,
            height_px: 1.0,
            triangles,
        };
        let ladder = vec![step(0.0, 1000), step(20.0, 100), step(80.0, 10)];
        let spec = Spec {
            scene: Scene {
                farthest_m: 300.0,
                ..Scene::default()
            },
            ..Spec::default()
        };
        let view = View::looking(Vec3::ZERO, Vec3::NEG_Z, 1.0, 1.0);
        let found = frame(&view, &[kind], &[ladder], &spec, &mut Hiding::new(None));
        // At 10 m; at 50 m and, twice as large, at 90 m; at 90 m. The one at 400 m is past the end.
        assert_eq!(found.shown, [vec![1, 2, 1]]);
        assert_eq!(found.triangles(), 1000 + 200 + 10);
        assert_eq!(found.original_triangles, 5000);
        // Without a grid nothing is hidden.
        assert_eq!((found.hidden_trees, found.unhidden_triangles), (0, 1210));
        assert_eq!(found.distances, [[10.0, 90.0]]);
        // All stand in front of the eye, which is in front of them.
        let sector = found.seen[0].sector().unwrap();
        assert_eq!(sector.azimuths_deg, [350.0, 370.0]);
        assert_eq!(sector.elevations_deg, [-10.0, 10.0]);
    }
}
