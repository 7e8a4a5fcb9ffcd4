//! One level of a package: which wood and cards draw it, their texels, and its covered area.

mod facing;
mod few;
mod fit;
mod share;
mod sided;
mod tone;

use glam::Vec3;

use rayon::prelude::*;

use crate::botany::model::Image;
use crate::botany::tree::Tree;
use crate::cloud::{Occlusion, Outline};
use crate::detail::adapt::AdaptOptions;
use crate::detail::adaptive_level::adaptive_level;
use crate::detail::element::{Element, mean_radius};
use crate::detail::level::{LevelPlan, Planner};
use crate::detail::merge::Hierarchy;
use crate::detail::opaque::Opaque;
use crate::detail::optimal_cut::{Candidate, Choice, Pruning};
use crate::detail::reassign::Reassign;
use crate::detail::whole_tree::{crossed_quads, level_cards, whole_tree};
use crate::detail::wood::{Wood, WoodOption};
use crate::error::Result;
use crate::export::chart::Chart;
use crate::export::coarser::coarsen_light;
use crate::export::maps::first_of_page;
use crate::export::matching::Matched;
use crate::export::original::Original;
use crate::export::surface::{Scene, scene_of_model};
use crate::ladder::{Rung, WHOLE_TREE_TRIANGLES};
use crate::recipe::{Billboard, Method, Recipe};
use crate::watch::{Watch, part};

pub use fit::{Fitted, MASK_HEIGHT};
pub use share::{Guest, Page, Table, half};

/// What every level of a tree is baked from.
pub struct Baker<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// Its smallest pieces.
    pub elements: &'a [Element],
    /// What of its triangles is opaque.
    pub opaque: &'a Opaque,
    /// How they merge.
    pub hierarchy: &'a Hierarchy,
    /// The branches' tubes.
    pub wood: &'a Wood<'a>,
    /// The original's masks.
    pub original: &'a Original,
    /// Knobs.
    pub recipe: &'a Recipe,
}

/// What one level is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRequest {
    /// Most triangles, wood included.
    pub triangles: u64,
    /// Height of the tree in pixels where the level starts.
    pub height_px: f32,
    /// Height of the tree in texels of its cards.
    pub height_texels: f32,
    /// It starts no nearer than where its error (root mean square) is so many pixels.
    pub most_error_px: Option<f64>,
}

impl LevelRequest {
    /// What a rung asks for.
    pub fn of(rung: &Rung, method: Method) -> Self {
        let height_px = rung.height_px as f32;
        // Levels are looked at from nearer than they are made for: never fewer texels than this.
        let whole = rung.triangles <= WHOLE_TREE_TRIANGLES && method != Method::CrossedQuads;
        let least = if whole { 64.0 } else { 256.0 };
        Self {
            triangles: rung.triangles,
            height_px,
            height_texels: height_px.max(least),
            most_error_px: None,
        }
    }

    /// The request for where a level of so large an error may start; `height` and `error` are in one
    /// unit. It has at most two texels a pixel there: nobody sees it from nearer.
    fn no_nearer_than(self, error: f64, height: f32) -> Self {
        let Some(most) = self.most_error_px else {
            return self;
        };
        let farthest = (most * f64::from(height) / error.max(1e-30)) as f32;
        let height_px = self.height_px.min(farthest.max(LEAST_HEIGHT_PX));
        Self {
            height_px,
            height_texels: self.height_texels.min(2.0 * height_px),
            ..self
        }
    }
}

/// A level, not yet written.
#[derive(Clone, Debug)]
pub struct Level {
    /// What to draw: wood, then the cards, whose images come last.
    pub scene: Scene,
    /// What it was made for.
    pub request: LevelRequest,
    /// Cards and wood of the cut.
    pub plan: LevelPlan,
    /// Threshold of the alpha, and what it gave.
    pub matched: Matched,
    /// Where each card lies in the atlas, then the backs of those that have one.
    pub charts: Vec<Chart>,
    /// Size of the atlas in texels.
    pub atlas: [u32; 2],
    /// Texels a normalised unit that were asked for.
    pub density: f32,
    /// Largest squared difference of a card that shows another's texels from what it should look like, over that of an
    /// empty card; 0 where none does.
    pub farthest_copy: f32,
    /// The same level with cards that share texels, the fewest texels first; empty where the recipe asks
    /// for none or none is good enough.
    pub shared: Vec<Level>,
}

impl Level {
    /// Where the back of a card lies, if it has texels of its own.
    pub fn back_of(&self, card: u32) -> Option<&Chart> {
        let nth = self.plan.sided.iter().position(|&sided| sided == card)?;
        self.charts.get(self.plan.cards.len() + nth)
    }

    /// The same with sides of its maps of light halved so many times: see [`coarser`](crate::export::coarser).
    pub fn with_coarser_light(mut self, halvings: u32) -> Self {
        coarsen_light(self.page_images_mut(), halvings);
        self
    }

    /// The images of the page of its cards, base colour with alpha first; none where it has no cards.
    pub fn page_images(&self) -> &[Image] {
        let images = &self.scene.images;
        let first = first_of_page(images).filter(|_| !self.plan.cards.is_empty());
        first.map_or(&[], |first| &images[first..])
    }

    /// As [`Level::page_images`], to be changed.
    fn page_images_mut(&mut self) -> &mut [Image] {
        let first = self.scene.images.len() - self.page_images().len();
        &mut self.scene.images[first..]
    }

    /// The page of its cards: base colour with alpha.
    pub fn page(&self) -> Option<&Image> {
        self.page_images().first()
    }
}

/// Where a tree is this high, in pixels, no error of it is seen any more.
const LEAST_HEIGHT_PX: f32 = 16.0;

/// A view that shows less of its area than this vanishes: level cards are added for it.
const LEAST_VIEW: f64 = 0.92;

/// Most crossed quads of a level.
const MOST_CROSSED: u64 = 32;

/// How many level cards.
const LEVEL_CARDS: u64 = 4;

impl Baker<'_> {
    /// Makes one level.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::error::Error::Interrupted).
    pub fn level(&self, request: LevelRequest, watch: &dyn Watch) -> Result<Level> {
        match self.fitted(request, watch)? {
            Some(fitted) => self.finished(fitted, watch),
            None => Ok(self.original_itself(request)),
        }
    }

    /// A level with its wood and texels; `None`: the original fits into the budget as it is.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::error::Error::Interrupted).
    pub fn fitted(&self, request: LevelRequest, watch: &dyn Watch) -> Result<Option<Fitted>> {
        match self.seen_from_both_sides(request, watch)? {
            Some(made) => self.facing(made, request, watch).map(Some),
            None => Ok(None),
        }
    }

    /// As [`Baker::fitted`], of cards that show their leaves from both sides.
    fn seen_from_both_sides(
        &self,
        request: LevelRequest,
        watch: &dyn Watch,
    ) -> Result<Option<Fitted>> {
        part(watch, "cut")?;
        if self.recipe.method == Method::CrossedQuads {
            let count = (request.triangles / 2).clamp(1, MOST_CROSSED) as usize;
            let plan = crossed_quads(&self.tree.model, self.elements, count);
            return self.fit(plan, request, watch).map(Some);
        }
        let model = &self.tree.model;
        if request.triangles >= model.triangles.len() as u64 {
            return Ok(None);
        }
        let Some(plan) = self.cut(request) else {
            let plan = whole_tree(model, self.elements, &self.radii(), request.triangles);
            return self.fit(plan, request, watch).map(Some);
        };
        let made = self.fit(plan, request, watch)?;
        let made = self.nearer(made, request, watch)?;
        let least = made.least_view(self.original);
        if least >= LEAST_VIEW {
            return Ok(Some(made));
        }
        // Curtains of weeping twigs have upright planes, and seen from above these are lines.
        part(watch, "cut")?;
        let Some(plan) = self.cut_with_level_cards(request) else {
            return Ok(Some(made));
        };
        let other = self.fit(plan, request, watch)?;
        let better = other.least_view(self.original) > least;
        Ok(Some(if better { other } else { made }))
    }

    /// The level of a tree that fits into its budget as it is: nothing is nearer.
    pub fn original_itself(&self, request: LevelRequest) -> Level {
        let model = &self.tree.model;
        Level {
            scene: scene_of_model(model, 0..model.triangles.len() as u32),
            request,
            plan: LevelPlan::default(),
            matched: Matched::default(),
            charts: Vec::new(),
            atlas: [0; 2],
            density: 0.0,
            farthest_copy: 0.0,
            shared: Vec::new(),
        }
    }

    /// The cut within a budget; `None`: a whole-tree billboard is all that fits.
    fn cut(&self, request: LevelRequest) -> Option<LevelPlan> {
        if request.triangles <= WHOLE_TREE_TRIANGLES {
            return None;
        }
        let choices = self.choices();
        let planner = self.planner(&choices);
        if self.recipe.method == Method::OptimalCut {
            return self.sided(request.triangles, |budget| planner.plan(budget));
        }
        let cut = planner.plan(request.triangles)?;
        let centers: Vec<Vec3> = self.tree.leaves.iter().map(|l| l.center).collect();
        if centers.is_empty() {
            return Some(cut);
        }
        let tried = |billboard| self.recipe.billboards.contains(&billboard);
        let normal = AdaptOptions::default();
        let options = AdaptOptions {
            epsilon: self.recipe.validity_px / f64::from(request.height_px)
                * f64::from(self.original.height),
            tolerance: self.recipe.tolerance,
            triangles: Some(request.triangles as usize),
            outline: self.outline(),
            crosses: tried(Billboard::Cross),
            strip_sections: match tried(Billboard::Strip) {
                true => normal.strip_sections,
                false => 0,
            },
            ..normal
        };
        let occlusion = Occlusion::of_leaves(&centers, self.tree.model.height());
        let plan = adaptive_level(&planner, self.tree, &occlusion, cut, options);
        Some(plan)
    }

    fn planner<'c>(&'c self, choices: &'c [Vec<Choice>]) -> Planner<'c> {
        Planner {
            model: &self.tree.model,
            elements: self.elements,
            opaque: self.opaque,
            hierarchy: self.hierarchy,
            choices,
            outline: self.outline(),
            reassign: Reassign {
                rounds: self.recipe.reassign_rounds,
                locality: self.recipe.locality,
                neighbours: 12,
            },
        }
    }

    fn outline(&self) -> Outline {
        match self.recipe.triangular_cards {
            true => Outline::Triangle,
            false => Outline::Quad,
        }
    }

    fn cut_with_level_cards(&self, request: LevelRequest) -> Option<LevelPlan> {
        let mut plan = self.cut(LevelRequest {
            triangles: request.triangles.saturating_sub(2 * LEVEL_CARDS),
            ..request
        })?;
        let on_cards: Vec<u32> = plan.members.iter().flatten().copied().collect();
        let level = level_cards(
            &self.tree.model,
            self.elements,
            &on_cards,
            LEVEL_CARDS as usize,
        );
        plan.cards.extend(level.cards);
        plan.members.extend(level.members);
        Some(plan)
    }

    /// Root of the area-weighted mean squared distance between what a plan draws and the original,
    /// normalised units.
    pub fn rms_error(&self, plan: &LevelPlan) -> f64 {
        (plan.error / self.area().max(1e-30)).sqrt()
    }

    fn area(&self) -> f64 {
        self.elements.iter().map(|e| f64::from(e.area)).sum()
    }

    /// Fewest triangles whose error is at most `pixels` where the tree is `height_px` high.
    pub fn triangles_within(&self, pixels: f64, height_px: f64) -> u64 {
        let length = pixels / height_px * f64::from(self.original.height);
        let choices = self.choices();
        self.pruning(&choices)
            .cut_within(self.area() * length * length)
            .triangles
    }

    /// Every budget's best cut, from one triangle up, for trees whose normalised unit is so many metres.
    pub fn candidates(&self, unit_m: f64) -> Vec<Candidate> {
        let choices = self.choices();
        let pruning = self.pruning(&choices);
        // Multipliers by factors of two: two cuts of which one costs a few percent more look alike.
        let exponents: Vec<i32> = (-120..40).collect();
        let cut = |&exponent: &i32| {
            let cut = pruning.at(f64::from(exponent).exp2());
            Candidate {
                triangles: cut.triangles,
                error_m: (cut.error / self.area().max(1e-30)).sqrt() * unit_m,
            }
        };
        let mut out: Vec<Candidate> = exponents.par_iter().map(cut).collect();
        out.dedup_by_key(|cut| cut.triangles);
        out
    }

    fn pruning<'c>(&'c self, choices: &'c [Vec<Choice>]) -> Pruning<'c> {
        Pruning {
            hierarchy: self.hierarchy,
            card_error: &self.hierarchy.error,
            card_triangles: if self.recipe.triangular_cards { 1 } else { 2 },
            choices,
        }
    }

    fn choices(&self) -> Vec<Vec<Choice>> {
        let choice = |o: &WoodOption, solid: bool| Choice {
            triangles: o.triangles,
            // A thick branch that is a ribbon or left out vanishes from some views: never chosen.
            error: if solid && !o.is_round() {
                f64::INFINITY
            } else {
                o.error
            },
        };
        let of_chain = |chain: u32, solid: bool| {
            let options = &self.wood.tube_options(chain).options;
            let solid = solid && options.iter().any(WoodOption::is_round);
            options.iter().map(|o| choice(o, solid)).collect()
        };
        self.elements
            .iter()
            .map(|e| e.chain.map_or(Vec::new(), |chain| of_chain(chain, e.solid)))
            .collect()
    }

    /// Mean radius of each element that is wood; 0 for leaves.
    fn radii(&self) -> Vec<f32> {
        let mean = |chain| mean_radius(self.tree, chain);
        self.elements
            .iter()
            .map(|e| e.chain.map_or(0.0, mean))
            .collect()
    }
}
