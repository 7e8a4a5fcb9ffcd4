//! The hierarchy of sub-trees, baked: billboards for every sub-tree that a cut may use.
//!
//! Levels are cuts that are made once, offline; a client that follows a camera makes its own from
//! these tiles.

mod look;

use rayon::prelude::*;
use serde_json::{Value, json};

use self::look::{Images, Look, look};
use crate::botany::branch::branch;
use crate::botany::tree::Tree;
use crate::detail::tiles::{self, TileSize, tiles};
use crate::error::Result;
use crate::export::hierarchy::{
    TileFiles, Tips, places, write_billboards, write_geometry, write_hierarchy,
};
use crate::export::manifest_tiles::{Billboards, Geometry, Tile, Tiles};
use crate::export::package::Package;
use crate::export::tileset::tileset;
use crate::ladder::WHOLE_TREE_TRIANGLES;
use crate::recipe::Recipe;
use crate::scene::Scene;
use crate::watch::{Quiet, Watch, begin, step};

/// Tiles of a tree at most, about: a sub-tree with a smaller share of its triangles is none.
const SHARES: usize = 128;

/// Times the least that loose pieces hold before they are halved.
const LOOSE: usize = 4;

/// Bakes and writes the hierarchy of a tree; returns what the manifest says of it, and the names of
/// the images that its files share.
///
/// # Errors
/// [`Error::Interrupted`](crate::error::Error::Interrupted), [`Error::Io`](crate::error::Error::Io).
pub fn bake_tiles(
    package: &Package,
    tree: &Tree,
    recipe: &Recipe,
    scene: &Scene,
    watch: &dyn Watch,
) -> Result<(Tiles, Vec<String>)> {
    let cost = recipe.tile_triangles as usize;
    let least = (tree.model.triangles.len() / SHARES).max(4 * cost);
    let size = TileSize {
        least,
        most: LOOSE * least,
    };
    let found = tiles(tree, size);
    begin(watch, "bake tiles", found.len() as u64)?;
    let images = Images::of(tree);
    let mut made: Vec<Made> = Vec::with_capacity(found.len());
    let mut generation = vec![(0, None)];
    while !generation.is_empty() {
        let first = made.len();
        let bake = |(i, &(at, parent)): (usize, &(u32, Option<u32>))| {
            let found = &found[at as usize];
            let made = tile(
                (tree, &images),
                found,
                (first + i, parent),
                (recipe, scene),
                watch,
            )?;
            step(watch).map(|()| made)
        };
        let baked: Vec<Made> = generation
            .par_iter()
            .enumerate()
            .map(bake)
            .collect::<Result<_>>()?;
        let mut next = Vec::new();
        for ((index, baked), (at, parent)) in (first as u32..).zip(baked).zip(generation) {
            if let Some(parent) = parent {
                made[parent as usize].tile.children.push(index);
            }
            if baked.opened {
                let children = found[at as usize].children.iter();
                next.extend(children.map(|&c| (c, Some(index))));
            }
            made.push(baked);
        }
        generation = next;
    }
    drop(images);
    let (mut list, mut files) = (Vec::new(), Vec::new());
    for made in made {
        list.push(made.tile);
        files.push(made.files);
    }
    rise(&mut list);
    for (index, (tile, files)) in list.iter().zip(&mut files).enumerate() {
        files.extras = extras(index, tile);
    }
    write(package, tree, scene, list, &files)
}

/// A tile as it is baked: without its children, and without what its nodes say of it.
struct Made {
    tile: Tile,
    files: TileFiles,
    /// Whether the scene shows what it is made of.
    opened: bool,
}

/// Bakes one tile, number `index` of its list.
fn tile(
    (tree, images): (&Tree, &Images),
    found: &tiles::Tile,
    (index, parent): (usize, Option<u32>),
    (recipe, scene): (&Recipe, &Scene),
    watch: &dyn Watch,
) -> Result<Made> {
    let part = branch(tree, &found.triangles);
    let wanted = match index {
        0 => WHOLE_TREE_TRIANGLES,
        _ => u64::from(recipe.tile_triangles),
    };
    let look = look(&part, images, (recipe, scene), wanted, &Quiet(watch))?;
    let mut tile = Tile {
        parent,
        ..describe(index, found, &part, look.as_ref(), scene)
    };
    let away = (part.model.frame.center - tree.model.frame.center).length();
    let nearest = scene.nearest_m - away;
    let opened = look.is_none() || f64::from(tile.switch_distance_m) > nearest;
    tile.geometry = tile.geometry.filter(|_| opened);
    let files = TileFiles {
        node: format!("tile {index}"),
        billboards: look.map(|l| l.level),
        frame: part.model.frame,
        geometry: tile.geometry.is_some().then(|| found.triangles.clone()),
        extras: Value::Null,
    };
    Ok(Made {
        tile,
        files,
        opened,
    })
}

/// Writes all files of the hierarchy.
fn write(
    package: &Package,
    tree: &Tree,
    scene: &Scene,
    mut list: Vec<Tile>,
    files: &[TileFiles],
) -> Result<(Tiles, Vec<String>)> {
    let name = &tree.model.name;
    let (rectangles, page) = places(files);
    for (tile, rectangle) in list.iter_mut().zip(&rectangles) {
        if let Some(billboards) = &mut tile.billboards {
            billboards.atlas = *rectangle;
        }
    }
    let out = Tiles {
        file: format!("{name}_hierarchy.glb"),
        tileset: format!("{name}_tileset.json"),
        atlas: page,
        list,
    };
    let tips = Tips::new(&tree.model, files)?;
    let all = write_hierarchy(&tree.model, files, &tips, &rectangles, page)?;
    package.write(&out.file, &all)?;
    drop(all);
    for (tile, files) in out.list.iter().zip(files) {
        if let (Some(b), Some(bytes)) = (&tile.billboards, write_billboards(files)?) {
            package.write(&b.file, &bytes)?;
        }
    }
    let images: Vec<String> = (0..tips.pngs.len())
        .map(|i| format!("{name}_image_{i}.png"))
        .collect();
    for (image, png) in images.iter().zip(&tips.pngs) {
        package.write(image, png)?;
    }
    let named = out.list.iter().filter_map(|t| t.geometry.as_ref());
    for (tip, bytes) in named.zip(write_geometry(&tree.model, &tips, &images)?) {
        package.write(&tip.file, &bytes)?;
    }
    let vanish = scene.distance(height_m(tree), scene.vanish_height_px);
    let set = tileset(&out.list, scene.focal_px(), vanish);
    package.write(&out.tileset, format!("{set:#}\n").as_bytes())?;
    Ok((out, images))
}

fn height_m(tree: &Tree) -> f64 {
    f64::from(tree.model.height()) * tree.model.frame.radius
}

/// What the manifest says of tile `index`.
fn describe(
    index: usize,
    tile: &tiles::Tile,
    part: &Tree,
    look: Option<&Look>,
    scene: &Scene,
) -> Tile {
    let (name, frame) = (&part.model.name, &part.model.frame);
    let square = frame.radius * frame.radius;
    let billboards = look.map(|look| Billboards {
        node: format!("tile {index}"),
        file: format!("{name}_tile_{index}.glb"),
        triangles: look.level.scene.triangles(),
        error_m: look.error * frame.radius,
        area_m2: look.coverage.total * square,
        coverage_m2: look.coverage.covered() * square,
        sigma: look.sigma,
        quality: look.coverage.quality(look.sigma) * square,
        atlas: [0; 4],
        optimal_distance_m: (look.texel * frame.radius * scene.focal_px()) as f32,
    });
    // Where it was made for: its texels are no larger than pixels there.
    let starts = look.map_or(0.0, |look| {
        let height = f64::from(part.model.height()) * frame.radius;
        height * scene.focal_px() / f64::from(look.level.request.height_px)
    });
    Tile {
        subtree: tile.subtree,
        whole: tile.whole,
        parent: None,
        children: Vec::new(),
        center: frame.center.as_vec3().to_array(),
        radius_m: frame.radius as f32,
        leaves: tile.leaves,
        triangles: tile.triangles.len() as u64,
        geometry: tile.children.is_empty().then(|| Geometry {
            node: format!("tile {index} geometry"),
            file: format!("{name}_tile_{index}_geometry.glb"),
        }),
        switch_distance_m: starts as f32,
        billboards,
    }
}

/// Lets no tile switch nearer than what it is made of: from there on, its parts are not needed.
fn rise(list: &mut [Tile]) {
    for i in (1..list.len()).rev() {
        if let Some(parent) = list[i].parent {
            let least = list[i].switch_distance_m;
            let up = &mut list[parent as usize].switch_distance_m;
            *up = up.max(least);
        }
    }
}

/// What a tile's nodes say of it.
fn extras(index: usize, tile: &Tile) -> Value {
    json!({
        "tile": index,
        "parent": tile.parent,
        "children": tile.children,
        "subtree": tile.subtree,
        "switch_distance_m": tile.switch_distance_m,
        "error_m": tile.billboards.as_ref().map(|b| b.error_m),
    })
}
