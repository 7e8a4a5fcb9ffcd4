//! What the manifest says of the hierarchy as it is written (`bake --hierarchy`).

use serde::{Deserialize, Serialize};

/// The hierarchy's files, and its tiles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tiles {
    /// The GLB with a node for all that any tile may show.
    pub file: String,
    /// The same as 3D Tiles 1.1.
    pub tileset: String,
    /// Width and height of the page that all billboards of [`Tiles::file`] share, texels.
    pub atlas: [u32; 2],
    /// Parents before children; 0 is the whole tree.
    pub list: Vec<Tile>,
}

/// A sub-tree that cuts may use, or some of what a sub-tree bears itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tile {
    /// Index into [`Manifest::subtrees`](super::manifest::Manifest::subtrees).
    pub subtree: u32,
    /// All of that sub-tree; else leaves and wood of its own branch, and twigs too small to be tiles.
    pub whole: bool,
    /// The tile that it is a part of, an index into [`Tiles::list`] smaller than its own.
    pub parent: Option<u32>,
    /// Tiles that together are this one, ascending; a tip has none: when opened it is geometry.
    pub children: Vec<u32>,
    /// Centre of its bounding sphere.
    pub center: [f32; 3],
    /// Radius of its bounding sphere.
    pub radius_m: f32,
    /// Leaves in it.
    pub leaves: u32,
    /// Triangles of the original.
    pub triangles: u64,
    /// What stands for it from afar; `None` where its geometry costs no more.
    pub billboards: Option<Billboards>,
    /// From this distance on billboards stand for it: one texel is at most a pixel, and the error no
    /// more than the recipe's `tile_error_px`.
    /// No smaller than that of its children.
    pub switch_distance_m: f32,
    /// What it is when opened, where it is a tip.
    pub geometry: Option<Geometry>,
}

/// A representation of a tile by billboards, and tubes of what wood is too thick for them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Billboards {
    /// Name of its node in [`Tiles::file`].
    pub node: String,
    /// The file of the tileset that holds it alone.
    pub file: String,
    /// Cost: triangles, wood included.
    pub triangles: u64,
    /// Root of the area-weighted mean squared distance between what is drawn and the original.
    pub error_m: f64,
    /// `A`: surface of the foliage that the cards show, one side, square metres.
    pub area_m2: f64,
    /// `C`: foliage within four texels of its card, minus what is farther off; square metres.
    pub coverage_m2: f64,
    /// `sigma`: how visible its middle is from anywhere, 1 free, 0 hidden by its own leaves.
    pub sigma: f64,
    /// `sigma * C`.
    pub quality: f64,
    /// Left, top, width, height of its part of the page, texels.
    pub atlas: [u32; 4],
    /// Distance at which one texel is one pixel.
    pub optimal_distance_m: f32,
}

/// A tip's triangles, as in the original.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Name of its node in [`Tiles::file`].
    pub node: String,
    /// The file of the tileset that holds it alone.
    pub file: String,
}

impl Tiles {
    /// The first flaw: its field and what is wrong; there are so many sub-trees.
    pub(super) fn flaw(&self, subtrees: usize) -> Option<(String, String)> {
        if self.list.is_empty() {
            let what = "there is none, not even the whole tree";
            return Some(("tiles.list".into(), what.into()));
        }
        let mut tiles = self.list.iter().enumerate();
        tiles.find_map(|(i, tile)| {
            let (field, what) = self.flaw_of(i, tile, subtrees)?;
            Some((format!("tiles.list[{i}].{field}"), what))
        })
    }

    fn flaw_of(&self, index: usize, tile: &Tile, subtrees: usize) -> Option<(String, String)> {
        let is_child = |c: &u32| {
            let child = self.list.get(*c as usize);
            child.is_some_and(|c| c.parent == Some(index as u32))
        };
        let parent_at = |p: u32| (p as usize) < index;
        let links = [
            (
                "subtree",
                (tile.subtree as usize) < subtrees,
                "there is no such sub-tree",
            ),
            (
                "parent",
                tile.parent.map_or(index == 0, parent_at),
                "a tile but the first has one, before it in the list",
            ),
            (
                "children",
                tile.children.iter().all(is_child),
                "one is missing, or has another parent",
            ),
        ];
        if let Some((field, _, what)) = links.into_iter().find(|(_, right, _)| !right) {
            return Some((field.into(), what.into()));
        }
        let [x, y, z] = tile.center;
        let own = [
            ("center", x),
            ("center", y),
            ("center", z),
            ("radius_m", tile.radius_m),
            ("switch_distance_m", tile.switch_distance_m),
        ];
        let own = own.map(|(field, number)| (field, f64::from(number)));
        let of_billboards = tile.billboards.iter().flat_map(|b| {
            [
                ("billboards.error_m", b.error_m),
                ("billboards.area_m2", b.area_m2),
                ("billboards.coverage_m2", b.coverage_m2),
                ("billboards.sigma", b.sigma),
                ("billboards.quality", b.quality),
            ]
        });
        let (field, number) = own
            .into_iter()
            .chain(of_billboards)
            .find(|(_, n)| !n.is_finite())?;
        Some((field.into(), format!("{number} is not a finite number")))
    }

    /// All files of the hierarchy beside images: the GLB, the tileset, and the tileset's contents.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let contents = self.list.iter().flat_map(|t| {
            let billboards = t.billboards.iter().map(|b| b.file.as_str());
            billboards.chain(t.geometry.iter().map(|g| g.file.as_str()))
        });
        [self.file.as_str(), self.tileset.as_str()]
            .into_iter()
            .chain(contents)
    }
}
