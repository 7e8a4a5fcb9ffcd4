//! What trees hide of each other: El-Sana's grid over the forest (El-Sana and others 2001, section 4).

use glam::Vec3;

use super::kind::Kind;
use crate::runtime::{Cells, Law, Occlusion, Place, splat};

/// Cells over the height of the mean tree.
const CELLS_A_TREE: f32 = 3.0;

/// Most cells of the forest: its edges grow where there would be more.
const MOST_CELLS: f32 = 2e6;

/// Share of the extinction that counts: leaves crowd, and what a plan must not miss asks for less than
/// is measured (see [`Occlusion::clumped`]).
const CLUMPING: f32 = 0.3;

/// The grid over all trees; `None` where there are none.
pub fn grid(kinds: &[Kind]) -> Option<Cells> {
    let all = || {
        kinds
            .iter()
            .flat_map(|k| k.spots.iter().map(move |s| (k, s)))
    };
    let count = all().count();
    let (mut low, mut high, mut height) = (Vec3::MAX, Vec3::MIN, 0.0f64);
    for (kind, spot) in all() {
        let (center, radius) = kind.sphere(spot);
        (low, high) = (low.min(center - radius), high.max(center + radius));
        height += kind.height_m * f64::from(spot.scale);
    }
    if count == 0 || !(high - low).is_finite() {
        return None;
    }
    let size = (high - low).max(Vec3::splat(1e-3));
    let asked = (height / count as f64) as f32 / CELLS_A_TREE;
    let cells = |edge: f32| (size / edge).ceil().max(Vec3::ONE);
    let mut edge = asked.max(size.max_element() / 1000.0);
    while cells(edge).element_product() > MOST_CELLS {
        edge *= 1.25;
    }
    let sides = cells(edge);
    let mut grid = Cells::new(low, low + sides * edge, sides.to_array().map(|c| c as u32));
    let mut extinction = vec![0.0; grid.solidity().len()];
    for (kind, spot) in all() {
        let (center, scale) = kind.sphere(spot);
        let place = Place {
            scale,
            ..Place::at(center)
        };
        splat(&mut grid, &mut extinction, &kind.cells, &place);
    }
    Some(grid)
}

/// How hidden trees are from the eye that was last looked from.
pub struct Hiding<'g>(Option<Occlusion<'g>>);

impl<'g> Hiding<'g> {
    /// Without a grid nothing is hidden.
    pub fn new(grid: Option<&'g Cells>) -> Self {
        Self(grid.map(|cells| Occlusion::new(cells, Law::Beer).clumped(CLUMPING)))
    }

    /// Moves the eye.
    pub fn look_from(&mut self, eye: Vec3) {
        if let Some(occlusion) = &mut self.0 {
            occlusion.look_from(eye);
        }
    }

    /// Probability that what is most visible of a tree is hidden: the least over its middle and its top.
    pub fn probability(&mut self, center: Vec3, height_m: f32) -> f32 {
        let Some(occlusion) = &mut self.0 else {
            return 0.0;
        };
        let top = center + Vec3::Y * (0.5 * height_m);
        let [middle, top] = [center, top].map(|p| occlusion.probability(p));
        middle.min(top)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, IVec3};

    use super::super::places::Spot;
    use super::*;
    use crate::export::maps::Maps;

    /// A row of trees 5 m apart that goes away from the eye; each is a solid block.
    fn row(count: usize, solidity: f32) -> Kind {
        let mut cells = Cells::new(Vec3::splat(-0.5), Vec3::splat(0.5), [2; 3]);
        for i in 0..8 {
            cells.set(IVec3::new(i & 1, i >> 1 & 1, i >> 2), solidity);
        }
        let spot = |i: usize| Spot {
            foot: Vec3::Z * -(10.0 + 5.0 * i as f32),
            scale: 1.0,
            turn: None,
        };
        Kind {
            name: "t".into(),
            input: "t.glb".into(),
            triangles: 1,
            texture_bytes: 0,
            file_bytes: 0,
            paints: Default::default(),
            maps: Maps::All,
            atlas: String::new(),
            height_m: 6.0,
            center: DVec3::Y * 3.0,
            radius_m: 6.0,
            spots: (0..count).map(spot).collect(),
            cells,
        }
    }

    #[test]
    fn the_farther_down_a_row_the_more_is_hidden_and_nothing_hides_the_first() {
        let kinds = [row(12, 0.8)];
        let grid = grid(&kinds).unwrap();
        let mut hiding = Hiding::new(Some(&grid));
        hiding.look_from(Vec3::Y * 1.7);
        let hidden: Vec<f32> = (0..12)
            .map(|i| hiding.probability(Vec3::new(0.0, 3.0, -10.0 - 5.0 * i as f32), 6.0))
            .collect();
        assert!(hidden[0] < 0.3, "{hidden:?}");
        assert!(hidden.windows(2).all(|w| w[0] <= w[1] + 1e-6), "{hidden:?}");
        assert!(hidden[11] > 0.9, "{hidden:?}");
        // From the side each is in the first row.
        let mut aside = Hiding::new(Some(&grid));
        aside.look_from(Vec3::new(60.0, 1.7, -40.0));
        assert!(aside.probability(Vec3::new(0.0, 3.0, -40.0), 6.0) < 0.5);
    }

    #[test]
    fn without_trees_or_without_leaves_nothing_is_hidden() {
        assert!(grid(&[]).is_none());
        assert_eq!(Hiding::new(None).probability(Vec3::ONE, 1.0), 0.0);
        let kinds = [row(5, 0.0)];
        let grid = grid(&kinds).unwrap();
        let mut hiding = Hiding::new(Some(&grid));
        hiding.look_from(Vec3::Y);
        assert_eq!(hiding.probability(Vec3::new(0.0, 3.0, -30.0), 6.0), 0.0);
    }
}
