//! One tile: a sub-tree baked as if it were a tree, for the distance where its texels are pixels.

use crate::botany::tree::{Organ, Tree};
use crate::cloud::coverage::{Coverage, coverage};
use crate::cloud::foliage::{Face, Foliage};
use crate::cloud::occlusion::Occlusion;
use crate::detail::element::{Element, elements, is_thick};
use crate::detail::merge::merge;
use crate::detail::opaque::Opaque;
use crate::detail::optimal_distance::TEXELS;
use crate::detail::wood::Wood;
use crate::error::Result;
use crate::export::original::{Original, Pictures};
use crate::level::{Baker, Level, LevelRequest};
use crate::recipe::Recipe;
use crate::scene::Scene;
use crate::watch::Watch;

/// Texels for a normalised unit of a tile: its bounding sphere has a radius of one.
const DENSITY: f32 = TEXELS as f32 / 2.0;

/// Samples of the tile's masks for a texel, along each axis.
const SAMPLES: f32 = 4.0;

/// Radius from which wood is drawn as tubes, in texels: thinner, it may vanish edge-on.
const SOLID_TEXELS: f32 = 1.0;

/// Distance to its card within which a leaf is valid, in texels.
const VALID_TEXELS: f64 = 4.0;

/// A tree's images, made ready once for all its tiles.
pub struct Images {
    silhouettes: Pictures,
    colors: Pictures,
}

impl Images {
    /// Of a whole tree.
    pub fn of(tree: &Tree) -> Self {
        Self {
            silhouettes: Pictures::silhouettes(&tree.model),
            colors: Pictures::colors(&tree.model),
        }
    }
}

/// Billboards of a tile, and how well they stand for it; lengths in the tile's normalised units.
pub struct Look {
    /// Cards and tubes.
    pub level: Level,
    /// Root of the area-weighted mean squared distance between what is drawn and the original.
    pub error: f64,
    /// Length of a texel.
    pub texel: f64,
    /// How much of its foliage the cards show.
    pub coverage: Coverage,
    /// `sigma`: how visible its middle is, 1 free, 0 hidden by its own leaves.
    pub sigma: f64,
}

/// Bakes a tile, a part of the tree that has these images, of at most so many triangles;
/// `None` where the tile itself has no more.
///
/// # Errors
/// [`Error::Interrupted`](crate::error::Error::Interrupted).
pub fn look(
    tree: &Tree,
    images: &Images,
    (recipe, scene): (&Recipe, &Scene),
    triangles: u64,
    watch: &dyn Watch,
) -> Result<Option<Look>> {
    if triangles >= tree.model.triangles.len() as u64 {
        return Ok(None);
    }
    let opaque = Opaque::of(tree);
    let mut elements = elements(tree, &opaque);
    for element in &mut elements {
        let thick = |chain| is_thick(tree, chain, SOLID_TEXELS / DENSITY);
        element.solid = element.chain.is_some_and(thick);
    }
    let height_texels = DENSITY * tree.model.height();
    let Images {
        silhouettes,
        colors,
    } = images;
    let (views, sector) = (recipe.training_views, scene.sector());
    let height_samples = SAMPLES * height_texels;
    let original = Original::new(&tree.model, silhouettes, views, sector, height_samples);
    let baker = Baker {
        tree,
        elements: &elements,
        opaque: &opaque,
        hierarchy: &merge(&elements, recipe.locality),
        wood: &Wood::new(tree, true),
        original: &original.with_tones(&tree.model, colors),
        recipe,
    };
    let request = LevelRequest {
        triangles,
        height_px: height_texels,
        height_texels,
        most_error_px: Some(recipe.tile_error_px),
    };
    let level = baker.level(request, watch)?;
    let texel = f64::from(tree.model.height() / level.request.height_texels);
    Ok(Some(Look {
        error: baker.rms_error(&level.plan),
        texel,
        coverage: shown(tree, &level, VALID_TEXELS * texel),
        sigma: sigma(tree, &elements),
        level,
    }))
}

/// What the cards show, each of its own leaves within `epsilon`.
fn shown(tree: &Tree, level: &Level, epsilon: f64) -> Coverage {
    let mut out = Coverage::default();
    let mut square = 0.0;
    for group in &level.plan.cards {
        let foliage = |t: &&u32| tree.organ[**t as usize] == Organ::Foliage;
        let shown = group.triangles.iter().filter(foliage);
        let faces: Vec<Face> = shown
            .filter_map(|&t| Face::new(tree.model.corners(t)))
            .collect();
        let foliage = Foliage {
            faces: &faces,
            connector: tree.subtrees[0].connector,
        };
        let cards = std::slice::from_ref(&group.card);
        let found = coverage(&foliage, cards, epsilon);
        out.valid += found.valid;
        out.invalid += found.invalid;
        out.total += found.total;
        out.within += found.within;
        square += found.mean_square * found.total;
    }
    out.mean_square = if out.total > 0.0 {
        square / out.total
    } else {
        0.0
    };
    out
}

/// Mean visibility of the elements, by area.
fn sigma(tree: &Tree, elements: &[Element]) -> f64 {
    let centers: Vec<_> = tree.leaves.iter().map(|l| l.center).collect();
    if centers.is_empty() {
        return 1.0;
    }
    let occlusion = Occlusion::of_leaves(&centers, tree.model.height());
    let of = |e: &Element| {
        [
            f64::from(e.area),
            f64::from(e.area) * occlusion.sigma(e.center),
        ]
    };
    let sums = elements.iter().map(of);
    let [area, seen] = sums.fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    if area > 0.0 { seen / area } else { 1.0 }
}
