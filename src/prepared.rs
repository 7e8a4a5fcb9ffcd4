//! A tree on its way to levels: what is read, recognised and made once for all of them.

use crate::botany::load::{load_slice, read};
use crate::botany::model::Model;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::detail::element::{Element, elements};
use crate::detail::merge::{Hierarchy, merge};
use crate::detail::opaque::Opaque;
use crate::detail::wood::Wood;
use crate::error::Result;
use crate::export::manifest::{Provenance, Range};
use crate::export::original::{Original, Pictures};
use crate::export::shipped::not_shipped;
use crate::ladder::{LEAST_TRIANGLES, Rung, ranges, rungs, seen};
use crate::level::{Baker, MASK_HEIGHT};
use crate::provenance::{check_name, provenance};
use crate::recipe::{Method, Recipe};
use crate::request::Request;
use crate::scene::{Mips, Scene};
use crate::watch::{Watch, begin};

/// A tree that was recognised, and which levels it gets.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Where it came from.
    pub provenance: Provenance,
    /// The tree.
    pub tree: Tree,
    /// The levels beside level 0 that the scene shows.
    pub rungs: Vec<Rung>,
    /// Where level 0 and these are shown.
    pub ranges: Vec<Range>,
}

impl Prepared {
    /// Reads and recognises the request's tree.
    ///
    /// # Errors
    /// Those of reading, and [`Error::Usage`](crate::error::Error::Usage) where its levels can't be.
    pub fn new(request: &Request, watch: &dyn Watch) -> Result<Self> {
        check_name(&request.input)?;
        let (mips, format) = (request.scene.mips, request.scene.texture_format);
        if mips == Mips::Shipped && !format.can_be_shipped() {
            return Err(not_shipped(format));
        }
        begin(watch, "load", 1)?;
        // Read once, so that what is described is what is baked (files that it refers to are read twice).
        let limits = &request.recipe.limits;
        let input = read(&request.input, limits)?;
        let provenance = provenance(request, &input)?;
        let mut model = load_slice(&input, &request.input, limits)?;
        drop(input);
        if !request.scene.lit {
            model.unlight();
        }
        let least = match request.recipe.method {
            Method::CrossedQuads => 4,
            _ => LEAST_TRIANGLES,
        };
        let (scene, triangles) = (&request.scene, model.triangles.len() as u64);
        let rungs = rungs(&request.wanted, scene, triangles, least)?;
        let rungs = seen(rungs, scene, height_m(&model));
        begin(watch, "recognise", 1)?;
        let organs = request.recipe.organs.clone();
        let tree = recognise(model, &RecogniseOptions { organs })?;
        let (height_m, wide) = (height_m(&tree.model), width_to_height(&tree.model));
        Ok(Self {
            provenance,
            ranges: ranges(&rungs, scene, height_m, wide),
            rungs,
            tree,
        })
    }
}

/// What all levels of a tree are made of.
pub struct Pieces<'t> {
    tree: &'t Tree,
    /// Its smallest pieces.
    pub elements: Vec<Element>,
    opaque: Opaque,
    hierarchy: Hierarchy,
    wood: Wood<'t>,
    original: Original,
}

impl<'t> Pieces<'t> {
    /// Groups a tree's pieces and looks at it from all sides.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::error::Error::Interrupted).
    pub fn new(tree: &'t Tree, recipe: &Recipe, scene: &Scene, watch: &dyn Watch) -> Result<Self> {
        begin(watch, "group and look", 1)?;
        let opaque = Opaque::of(tree);
        let elements = elements(tree, &opaque);
        let (views, sector) = (recipe.training_views, scene.sector());
        // Groups are merged one after the other, which leaves other threads free.
        let (hierarchy, (wood, original)) = rayon::join(
            || merge(&elements, recipe.locality),
            || {
                let wood = Wood::new(tree, true);
                let model = &tree.model;
                let silhouettes = Pictures::silhouettes(model);
                let original = Original::new(model, &silhouettes, views, sector, MASK_HEIGHT);
                drop(silhouettes);
                let colors = Pictures::colors(model);
                (wood, original.with_tones(model, &colors))
            },
        );
        Ok(Self {
            tree,
            elements,
            opaque,
            hierarchy,
            wood,
            original,
        })
    }

    /// What makes levels of them.
    pub fn baker<'a>(&'a self, recipe: &'a Recipe) -> Baker<'a> {
        Baker {
            tree: self.tree,
            elements: &self.elements,
            opaque: &self.opaque,
            hierarchy: &self.hierarchy,
            wood: &self.wood,
            original: &self.original,
            recipe,
        }
    }
}

fn height_m(model: &Model) -> f64 {
    f64::from(model.height()) * model.frame.radius
}

/// Wider side of the bounding box over its height.
fn width_to_height(model: &Model) -> f64 {
    let (mut low, mut high) = (glam::Vec3::MAX, glam::Vec3::MIN);
    for p in model
        .triangles
        .iter()
        .flatten()
        .map(|&i| model.positions[i as usize])
    {
        (low, high) = (low.min(p), high.max(p));
    }
    let size = (high - low).as_dvec3();
    size.x.max(size.z) / size.y.max(1e-9)
}
