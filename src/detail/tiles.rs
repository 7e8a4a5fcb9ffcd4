//! The hierarchy as it is written: sub-trees that a cut may use, each with what stands for it.
//!
//! A sub-tree with too few triangles to be worth a draw call of its own stays with what its carrier
//! bears itself: "loose" pieces. Many of those are halved in space until each is small, so that a
//! trunk with a thousand twigs has tiles, too. Where a sub-tree carries many large ones, neighbours
//! are grouped: between a tree and its thirty branches there are cuts. Children cover their parent:
//! every leaf is under exactly one child, and the tips together are the tree.

use glam::Vec3;

use super::element::{subtree_of_chain, wood_by_chain};
use crate::botany::tree::{NO_NODE, Organ, Tree};

/// A sub-tree, or some of what it bears itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tile {
    /// Index into [`Tree::subtrees`].
    pub subtree: u32,
    /// All of the sub-tree; else some of what it carries: a few of its branches, its own leaves and
    /// wood, twigs too small to be tiles.
    pub whole: bool,
    /// The tile that it is a part of, earlier in the list; `None` for the first alone.
    pub parent: Option<u32>,
    /// What it is made of; none for a tip, which is geometry when opened.
    pub children: Vec<u32>,
    /// Leaves in it.
    pub leaves: u32,
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
}

/// How small tiles may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileSize {
    /// Fewest triangles of a sub-tree that is a tile of its own.
    pub least: usize,
    /// Loose pieces of more triangles than this are halved.
    pub most: usize,
}

/// Pieces into which loose ones are split: two halvings.
const HALVINGS: u32 = 2;

/// What is never split: a leaf, or the wood of a chain.
struct Unit {
    triangles: Vec<u32>,
    center: Vec3,
    leaves: u32,
}

/// More parts than this are grouped.
const MOST_CHILDREN: usize = 8;

/// The tiles of a tree: parents before children, the whole tree first.
pub fn tiles(tree: &Tree, size: TileSize) -> Vec<Tile> {
    let builder = Builder::new(tree, size);
    let whole = Part {
        subtree: 0,
        of: Of::All,
    };
    let mut out = vec![builder.tile(&whole, None)];
    let mut work = vec![(0u32, whole)];
    while let Some((at, part)) = work.pop() {
        let parts = builder.parts(part);
        // A part that is all there is is no step.
        if parts.len() < 2 {
            continue;
        }
        for part in parts {
            let index = out.len() as u32;
            out.push(builder.tile(&part, Some(at)));
            out[at as usize].children.push(index);
            work.push((index, part));
        }
    }
    out
}

/// A tile before it is one.
struct Part {
    subtree: u32,
    of: Of,
}

/// What of a sub-tree.
enum Of {
    /// Everything.
    All,
    /// These units.
    Units(Vec<u32>),
    /// Neighbours among what it carries.
    Group(Vec<Part>),
}

struct Builder<'t> {
    tree: &'t Tree,
    size: TileSize,
    units: Vec<Unit>,
    /// Units that grow on each sub-tree's own branch.
    own: Vec<Vec<u32>>,
    /// Triangles of each sub-tree and all that it carries.
    count: Vec<usize>,
}

impl<'t> Builder<'t> {
    fn new(tree: &'t Tree, size: TileSize) -> Self {
        let of_chain = subtree_of_chain(tree);
        let mut out = Self {
            tree,
            size,
            units: Vec::new(),
            own: vec![Vec::new(); tree.subtrees.len()],
            count: vec![0; tree.subtrees.len()],
        };
        let mut of_leaf = vec![0; tree.leaves.len()];
        for (index, subtree) in (0..).zip(&tree.subtrees) {
            for &leaf in &subtree.leaves {
                of_leaf[leaf as usize] = index;
            }
        }
        for (leaf, subtree) in tree.leaves.iter().zip(of_leaf) {
            out.add(subtree, leaf.triangles.to_vec(), 1);
        }
        for (chain, triangles) in wood_by_chain(tree).into_iter().enumerate() {
            out.add(of_chain[chain], triangles, 0);
        }
        let loose = |t: &u32| {
            tree.organ[*t as usize] == Organ::Wood && tree.wood_node[*t as usize] == NO_NODE
        };
        let all = 0..tree.model.triangles.len() as u32;
        out.add(0, all.filter(loose).collect(), 0);
        for (subtree, own) in out.own.iter().enumerate() {
            let triangles = own.iter().map(|&u| out.units[u as usize].triangles.len());
            out.count[subtree] = triangles.sum();
        }
        for i in (1..out.count.len()).rev() {
            if let Some(parent) = tree.subtrees[i].parent {
                out.count[parent as usize] += out.count[i];
            }
        }
        out
    }

    fn add(&mut self, subtree: u32, triangles: Vec<u32>, leaves: u32) {
        if triangles.is_empty() {
            return;
        }
        let corners = triangles.iter().flat_map(|&t| self.tree.model.corners(t));
        let center = corners.sum::<Vec3>() / (3 * triangles.len()) as f32;
        self.own[subtree as usize].push(self.units.len() as u32);
        self.units.push(Unit {
            triangles,
            center,
            leaves,
        });
    }

    /// All units of a sub-tree and of what it carries.
    fn under(&self, subtree: u32) -> Vec<u32> {
        let (mut out, mut stack) = (Vec::new(), vec![subtree]);
        while let Some(next) = stack.pop() {
            out.extend(&self.own[next as usize]);
            stack.extend(&self.tree.subtrees[next as usize].children);
        }
        out.sort_unstable();
        out
    }

    /// All units of a part.
    fn units(&self, part: &Part) -> Vec<u32> {
        match &part.of {
            Of::All => self.under(part.subtree),
            Of::Units(units) => units.clone(),
            Of::Group(parts) => parts.iter().flat_map(|p| self.units(p)).collect(),
        }
    }

    fn tile(&self, part: &Part, parent: Option<u32>) -> Tile {
        let numbers = self.units(part);
        let units = || numbers.iter().map(|&u| &self.units[u as usize]);
        let mut triangles: Vec<u32> = units().flat_map(|u| u.triangles.iter().copied()).collect();
        triangles.sort_unstable();
        Tile {
            subtree: part.subtree,
            whole: matches!(part.of, Of::All),
            parent,
            children: Vec::new(),
            leaves: units().map(|u| u.leaves).sum(),
            triangles,
        }
    }

    /// What a part is made of.
    fn parts(&self, part: Part) -> Vec<Part> {
        let parts = match part.of {
            Of::All => self.open(part.subtree),
            Of::Units(units) => return self.split(part.subtree, units),
            Of::Group(parts) => parts,
        };
        if parts.len() <= MOST_CHILDREN {
            return parts;
        }
        let weighed = |part: Part| {
            let units = self.units(&part);
            let units = units.iter().map(|&u| &self.units[u as usize]);
            let sums = units.map(|u| (u.center * u.triangles.len() as f32, u.triangles.len()));
            let (center, weight) = sums.fold((Vec3::ZERO, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            (part, center / weight as f32, weight)
        };
        let mut groups = vec![parts.into_iter().map(weighed).collect::<Vec<_>>()];
        for _ in 0..HALVINGS {
            groups = groups
                .into_iter()
                .flat_map(|g| halves(g, |p| p.1, |p| p.2))
                .collect();
        }
        let group = |mut parts: Vec<(Part, Vec3, usize)>| match parts.len() {
            1 => parts.remove(0).0,
            _ => Part {
                subtree: part.subtree,
                of: Of::Group(parts.into_iter().map(|p| p.0).collect()),
            },
        };
        groups.into_iter().map(group).collect()
    }

    /// What a sub-tree is made of: the large ones that it carries, and the rest.
    ///
    /// Where it carries one large one and little else, that one's parts take its place: every step
    /// then splits off a share of the tree, and a chain of a thousand orders is no thousand tiles.
    fn open(&self, subtree: u32) -> Vec<Part> {
        let (mut at, mut rest) = (subtree, Vec::new());
        loop {
            let carried = &self.tree.subtrees[at as usize].children;
            let (large, small): (Vec<u32>, Vec<u32>) = carried
                .iter()
                .partition(|&&c| self.count[c as usize] >= self.size.least);
            rest.extend(&self.own[at as usize]);
            rest.extend(small.iter().flat_map(|&s| self.under(s)));
            let loose = |u: &u32| self.units[*u as usize].triangles.len();
            match large.as_slice() {
                [] => return self.split(subtree, rest),
                &[only] if rest.iter().map(loose).sum::<usize>() < self.size.least => at = only,
                _ => {
                    let all = |subtree| Part {
                        subtree,
                        of: Of::All,
                    };
                    let rest = (!rest.is_empty()).then_some(Part {
                        subtree,
                        of: Of::Units(rest),
                    });
                    return large.into_iter().map(all).chain(rest).collect();
                }
            }
        }
    }

    /// Loose units in a few compact parts; one part if they are few.
    fn split(&self, subtree: u32, units: Vec<u32>) -> Vec<Part> {
        let unit = |u: &u32| &self.units[*u as usize];
        let triangles = |u: &u32| unit(u).triangles.len();
        let mut groups = vec![units];
        for _ in 0..HALVINGS {
            let halved = |group: Vec<u32>| match group.iter().map(triangles).sum::<usize>() {
                few if few <= self.size.most => vec![group],
                _ => halves(group, |u| unit(u).center, triangles),
            };
            groups = groups.into_iter().flat_map(halved).collect();
        }
        let part = |units| Part {
            subtree,
            of: Of::Units(units),
        };
        groups.into_iter().map(part).collect()
    }
}

/// Halves of about as much weight along the longest extent; all where there is nothing to halve.
fn halves<T>(
    mut items: Vec<T>,
    center: impl Fn(&T) -> Vec3,
    weight: impl Fn(&T) -> usize,
) -> Vec<Vec<T>> {
    let centers = items.iter().map(&center);
    let (low, high) = centers.fold((Vec3::MAX, Vec3::MIN), |(a, b), c| (a.min(c), b.max(c)));
    if items.len() < 2 || low == high {
        return vec![items];
    }
    let axis = (high - low).max_position();
    // Stable: equal ones keep their order.
    items.sort_by(|a, b| center(a)[axis].total_cmp(&center(b)[axis]));
    let all: usize = items.iter().map(&weight).sum();
    let mut sum = 0;
    let half = items.iter().position(|item| {
        sum += weight(item);
        2 * sum >= all
    });
    let cut = half.map_or(1, |i| i + 1).min(items.len() - 1);
    let second = items.split_off(cut);
    vec![items, second]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::{Limits, load_slice};
    use crate::botany::recognise::{RecogniseOptions, recognise};
    use crate::botany::tree::TriangleList;

    fn grown(species: &str, leaves: u32) -> Tree {
        let options = Options {
            leaves: (leaves > 0).then_some(leaves),
            ..Options::default()
        };
        let grown = grow(&Species::named(species).unwrap(), &options).unwrap();
        let file = std::path::Path::new("tree.glb");
        let model = load_slice(&grown.glb, file, &Limits::default()).unwrap();
        recognise(model, &RecogniseOptions::default()).unwrap()
    }

    /// Children are a partition of their parent, the first tile is the whole tree.
    fn check(tree: &Tree, tiles: &[Tile]) {
        let all: Vec<u32> = (0..tree.model.triangles.len() as u32).collect();
        assert_eq!((&tiles[0].triangles, tiles[0].parent), (&all, None));
        assert_eq!(tiles[0].leaves as usize, tree.leaves.len());
        for (index, tile) in (0..).zip(tiles) {
            assert!(!tile.triangles.is_empty());
            if tile.children.is_empty() {
                continue;
            }
            assert!(tile.children.len() > 1, "{index} has one child: no step");
            let children = || tile.children.iter().map(|&c| &tiles[c as usize]);
            let mut below: Vec<u32> = children().flat_map(|c| c.triangles.clone()).collect();
            below.sort_unstable();
            assert_eq!(below, tile.triangles, "tile {index}");
            assert_eq!(children().map(|c| c.leaves).sum::<u32>(), tile.leaves);
            assert!(children().all(|c| c.parent == Some(index)));
        }
    }

    #[test]
    fn tips_are_the_tree_whatever_the_sizes() {
        for (species, leaves) in [("oak", 900), ("palm", 40), ("birch_winter", 0)] {
            let tree = grown(species, leaves);
            for least in [1, 50, 400, 100_000] {
                let most = 4 * least;
                let tiles = tiles(&tree, TileSize { least, most });
                check(&tree, &tiles);
                let too_large = |t: &&Tile| t.children.is_empty() && t.triangles.len() > most;
                let units = tiles.iter().filter(too_large).count();
                // What can't be split is one leaf's or one chain's.
                assert!(units <= tree.skeleton.chains.len(), "{species} {least}");
            }
        }
    }

    #[test]
    fn a_tree_smaller_than_a_tile_is_one() {
        let tree = grown("palm", 20);
        let size = TileSize {
            least: 1 << 20,
            most: 1 << 20,
        };
        assert_eq!(tiles(&tree, size).len(), 1);
    }

    #[test]
    fn sub_trees_are_tiles_where_they_are_large_enough() {
        let tree = grown("oak", 900);
        let few = tiles(
            &tree,
            TileSize {
                least: 800,
                most: 3200,
            },
        );
        let many = tiles(
            &tree,
            TileSize {
                least: 100,
                most: 400,
            },
        );
        let whole = |tiles: &[Tile]| tiles.iter().filter(|t| t.whole).count();
        assert!(
            whole(&few) > 2 && whole(&many) > 2 * whole(&few),
            "{} {}",
            whole(&few),
            whole(&many)
        );
        assert!(
            many.iter()
                .filter(|t| t.whole)
                .all(|t| t.triangles.len() >= 100)
        );
    }

    #[test]
    fn a_chain_of_a_thousand_orders_is_few_tiles() {
        let orders = 1000u32;
        let mut tree = Tree::default();
        for i in 0..orders {
            let at = Vec3::Y * i as f32;
            let first = tree.model.positions.len() as u32;
            tree.model
                .positions
                .extend([at, at + Vec3::X, at + Vec3::Z]);
            tree.model.triangles.push([first, first + 1, first + 2]);
            tree.organ.push(Organ::Foliage);
            tree.wood_node.push(NO_NODE);
            tree.leaves.push(crate::botany::tree::Leaf {
                triangles: TriangleList::from_slice(&[i]),
                ..Default::default()
            });
            tree.subtrees.push(crate::botany::tree::Subtree {
                parent: i.checked_sub(1),
                children: (i + 1 < orders).then_some(i + 1).into_iter().collect(),
                leaves: vec![i],
                ..Default::default()
            });
        }
        let tiles = tiles(
            &tree,
            TileSize {
                least: 50,
                most: 200,
            },
        );
        check(&tree, &tiles);
        assert!((10..60).contains(&tiles.len()), "{}", tiles.len());
    }
}
