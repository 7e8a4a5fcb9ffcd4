//! A tree's levels as they are made, one after the other, and what the manifest says of them.

use crate::botany::tree::Tree;
use crate::describe::Describer;
use crate::detail::element::Element;
use crate::detail::optimal_distance::TEXELS;
use crate::export::combined::{Packed, extras};
use crate::export::manifest::{self, FORMAT, Manifest, Range, VERSION};
use crate::export::surface::{Scene, materials_of_model, scene_of_model};
use crate::ladder::{Rung, WHOLE_TREE_TRIANGLES};
use crate::level::{Baker, Level};
use crate::request::Request;

/// Levels of a tree, the original first.
pub struct Levels<'a> {
    request: &'a Request,
    tree: &'a Tree,
    ranges: &'a [Range],
    describer: Describer<'a>,
    /// What was made so far.
    pub packed: Vec<Packed>,
    /// What is said of them.
    pub manifest: Manifest,
}

impl<'a> Levels<'a> {
    /// The original alone; `ranges` are those of all levels to come, level 0 included.
    pub fn new(
        request: &'a Request,
        tree: &'a Tree,
        elements: &'a [Element],
        ranges: &'a [Range],
    ) -> Self {
        let describer = Describer::new(tree, elements, &request.scene);
        let manifest = Manifest {
            format: FORMAT.into(),
            version: VERSION,
            recipe: request.recipe.clone().as_described(),
            scene: request.scene.clone(),
            tree: describer.original(),
            subtree_texels: TEXELS,
            subtrees: describer.subtrees(),
            ..Manifest::default()
        };
        let mut out = Self {
            request,
            tree,
            ranges,
            describer,
            packed: Vec::with_capacity(ranges.len()),
            manifest,
        };
        // Its surfaces are as large as the tree and wait for the last level: `add_original` makes them.
        let materials = materials_of_model(&tree.model);
        let level = manifest::Level {
            file: match out.shows_original() {
                true => out.name(0) + ".glb",
                false => String::new(),
            },
            triangles: tree.model.triangles.len() as u64,
            range: ranges[0],
            ..manifest::Level::default()
        };
        out.push(materials, level);
        out
    }

    /// Gives level 0 its geometry, once all others are made.
    pub fn add_original(&mut self) {
        let level = &mut self.packed[0];
        if level.shown {
            let model = &self.tree.model;
            let all = scene_of_model(model, 0..model.triangles.len() as u32);
            level.scene.surfaces = all.surfaces;
        }
    }

    /// Adds the next level.
    pub fn add(&mut self, made: Level) {
        let number = self.packed.len();
        let file = self.name(number) + ".glb";
        let range = self.ranges[number];
        let described = self.describer.level(number, &file, &made, range);
        self.push(made.scene, described);
    }

    /// Says that a card of the last level shows texels of the card `of`, of another tree where that is named.
    pub fn copy(&mut self, card: u32, of: u32, tree: Option<&String>) {
        let last = self.manifest.levels.last_mut();
        if let Some(card) = last.and_then(|level| level.cards.get_mut(card as usize)) {
            (card.copy_of, card.copy_in) = (Some(of), tree.cloned());
        }
    }

    fn push(&mut self, scene: Scene, level: manifest::Level) {
        let number = self.packed.len();
        let height_m = self.manifest.tree.height_m;
        let screen = &self.request.scene;
        self.packed.push(Packed {
            name: self.name(number),
            pngs: Vec::new(),
            scene,
            extras: extras(number, &level.range, level.error_m, height_m, screen),
            range: level.range,
            shown: number > 0 || self.shows_original(),
        });
        self.manifest.levels.push(level);
    }

    /// Whether the scene comes so near that level 0 is seen, be it while level 1 fades in over it. Where no level is
    /// seen at all it is what there is.
    fn shows_original(&self) -> bool {
        let next = self.ranges.get(1);
        next.is_none_or(|next| self.request.scene.shows(0.0, next.fade_m[1]))
    }

    fn name(&self, level: usize) -> String {
        format!("{}_LOD{level}", self.tree.model.name)
    }
}

/// The rung with as many triangles as the request's error needs, if it bounds it.
pub fn needed(rung: &Rung, max_error_px: Option<f64>, baker: &Baker) -> Rung {
    let enough = max_error_px.map_or(u64::MAX, |pixels| {
        baker
            .triangles_within(pixels, rung.height_px)
            .max(WHOLE_TREE_TRIANGLES)
    });
    Rung {
        triangles: rung.triangles.min(enough),
        ..*rung
    }
}
