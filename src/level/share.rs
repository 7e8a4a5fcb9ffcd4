//! Levels whose cards share texels: those of one tree, or of several trees on one page.

use std::ops::Range;

use super::fit::{Fitted, on_page};
use super::tone::toned;
use super::{Baker, Level};
use crate::error::Result;
use crate::export::atlas::MAX_SIDE;
use crate::export::coarser::coarsen_light;
use crate::export::level_scene::AreaGoal;
use crate::export::matching::{Matched, Matching, Standing};
use crate::export::original::Original;
use crate::export::refine::{Target, f1, refine};
use crate::export::share::{self, Cards, Kin, Lone, Plan, Shared, kin, lone, share};
use crate::watch::{Watch, part};

/// So many times the allowed loss may show in the fit's own measure, which sees single texels: it loses more than
/// pictures where the level starts, and what passes here is measured there.
const PASSES: f64 = 6.0;

/// Gutters over those of cards with texels of their own. Around small cards gutters are most of a page, and F1 says what
/// narrower ones do: with all of them the quaking aspen of 90,420 triangles can't afford half a page at its middle levels,
/// with a quarter they lose .005 and .007.
const GUTTER: f32 = 0.25;

impl Baker<'_> {
    /// A level with all that shares its texels, and at last what only has the maps of light of these.
    pub(super) fn finished(&self, fitted: Fitted, watch: &dyn Watch) -> Result<Level> {
        let mut shared = self.shared(&fitted, watch)?;
        let level = self.alone(fitted);
        if self.recipe.sharing > 0.0 && !level.charts.is_empty() {
            shared.push(self.as_if_shared(level.clone()));
        }
        Ok(Level { shared, ..level })
    }

    /// The level on a page of its own.
    pub fn alone(&self, fitted: Fitted) -> Level {
        let (level, mut page) = fitted.level(self.original);
        // All images beside all that colours are compared by are the most that a bake ever holds.
        let mut level = self.toned(level);
        level.scene.images.extend(page.take_light());
        level.with_coarser_light(self.recipe.own_light_halvings())
    }

    /// A level on a page of its own with maps of light as those have that share one.
    pub fn as_if_shared(&self, alone: Level) -> Level {
        let [own, shared] = [
            self.recipe.own_light_halvings(),
            self.recipe.shared_light_halvings(),
        ];
        alone.with_coarser_light(shared - own)
    }

    /// The level on pages of half the size, a quarter and so on, the smallest first, while it may lose no
    /// more than the recipe allows.
    fn shared(&self, fitted: &Fitted, watch: &dyn Watch) -> Result<Vec<Level>> {
        let mut out = Vec::new();
        if self.recipe.sharing == 0.0 || fitted.foliage.charts.len() < 2 {
            return Ok(out);
        }
        part(watch, "share")?;
        let guests = [Guest {
            baker: self,
            fitted,
        }];
        let table = Table::new(&guests);
        let mut size = fitted.foliage.size;
        while half(&mut size) {
            match table.seat(size, watch)? {
                Some(page) => out.extend(page.levels(&guests)),
                None => break,
            }
        }
        out.reverse();
        Ok(out)
    }
}

/// A page's fewest texels along a side.
const LEAST_SIDE: u32 = 16;

/// Halves the longer side, if it may.
pub fn half(size: &mut [u32; 2]) -> bool {
    let longer = usize::from(size[1] > size[0]);
    size[longer] /= 2;
    size[longer] >= LEAST_SIDE
}

/// A level that shares a page with those of other trees.
#[derive(Clone, Copy)]
pub struct Guest<'a> {
    /// Its tree.
    pub baker: &'a Baker<'a>,
    /// The level on a page of its own.
    pub fitted: &'a Fitted,
}

/// Levels that are to share a page, and what fits them to it.
pub struct Table<'a> {
    guests: &'a [Guest<'a>],
    /// What each level's fit wants of its texels.
    opacity: Vec<Vec<f32>>,
    /// Cards that show one leaf.
    lone: Vec<Vec<Option<Lone>>>,
    /// Sub-trees that cards show.
    kin: Vec<Vec<Option<Kin>>>,
    /// Which charts are whose.
    charts: Vec<Range<usize>>,
    /// Views of each tree.
    targets: Vec<Vec<Target>>,
    goals: Vec<AreaGoal>,
    /// Least F1 of each in the fit's own measure.
    least: Vec<f64>,
}

impl<'a> Table<'a> {
    /// Draws what the fit looks at; `guests` were fitted for sharing.
    pub fn new(guests: &'a [Guest<'a>]) -> Self {
        let mut charts: Vec<Range<usize>> = Vec::with_capacity(guests.len());
        for guest in guests {
            let start = charts.last().map_or(0, |c| c.end);
            charts.push(start..start + guest.fitted.foliage.charts.len());
        }
        let both = || guests.iter().zip(&charts);
        let targets: Vec<Vec<Target>> = both()
            .map(|(guest, charts)| guest.baker.targets(guest.fitted, charts.clone()))
            .collect();
        let least = |(guest, targets): (&Guest, &Vec<Target>)| {
            let own = &guest.fitted.foliage;
            f1(own, 0..own.charts.len(), targets) - PASSES * guest.baker.recipe.sharing
        };
        let least = guests.iter().zip(&targets).map(least).collect();
        let goal = |guest: &Guest| guest.baker.goal(guest.fitted.request);
        Self {
            guests,
            opacity: guests.iter().map(|g| g.fitted.opacity()).collect(),
            lone: guests
                .iter()
                .map(|g| lone(g.baker.tree, &g.fitted.plan.cards))
                .collect(),
            kin: guests
                .iter()
                .map(|g| kin(g.baker.tree, &g.fitted.plan.cards))
                .collect(),
            charts,
            targets,
            goals: guests.iter().map(goal).collect(),
            least,
        }
    }

    /// The smallest page on which every card has a tile as fine as it should be; where there is none the largest
    /// page there is.
    pub fn whole_page(&self) -> [u32; 2] {
        let area = |g: &Guest| g.fitted.foliage.size.map(u64::from).iter().product::<u64>();
        // Together they never need less than half of what they have: pages are half full at least.
        let least = self.guests.iter().map(area).sum::<u64>() / 4;
        let cards = self.cards();
        let mut size = [LEAST_SIDE; 2];
        let complete = |size| Plan::new(&cards, size).is_some_and(|plan| plan.is_complete());
        while u64::from(size[0]) * u64::from(size[1]) < least || !complete(size) {
            if size == [MAX_SIDE; 2] {
                break;
            }
            let shorter = usize::from(size[1] < size[0]);
            size[shorter] *= 2;
        }
        size
    }

    /// The levels on a page of this size; `None` where it doesn't hold most of them, or where one may lose
    /// more than its recipe allows.
    pub fn seat(&self, size: [u32; 2], watch: &dyn Watch) -> Result<Option<Page>> {
        part(watch, "share")?;
        let cards = self.cards();
        let tolerance = |g: &Guest| g.baker.recipe.copy_tolerance;
        let tolerance = self.guests.iter().map(tolerance).fold(1.0, f64::min);
        let Some(mut shared) = share(&cards, size, tolerance) else {
            return Ok(None);
        };
        part(watch, "share")?;
        let refining = self.guests[0].baker.refining();
        let targets: Vec<&Target> = self.targets.iter().flatten().collect();
        let score = refine(&shared.foliage, &targets, refining);
        let both = self.guests.iter().zip(&self.charts).zip(&self.goals);
        let stand = |((guest, charts), goal): ((&'a Guest<'a>, &Range<usize>), _)| Standing {
            charts: charts.clone(),
            wood: &guest.fitted.wood.surfaces,
            goal,
        };
        let standing: Vec<Standing> = both.map(stand).collect();
        let mut matching = Matching::new(&shared.foliage, score, &standing);
        let mut matched = matching.near(&mut shared.foliage);
        matching.client(&mut shared.foliage, &mut matched);
        let good = |(i, &least): (usize, &f64)| {
            f1(&shared.foliage, self.charts[i].clone(), &self.targets[i]) >= least
        };
        let page = self.least.iter().enumerate().all(good).then_some(Page {
            shared,
            matched,
            charts: self.charts.clone(),
        });
        Ok(page)
    }

    fn cards(&self) -> Vec<Cards<'_>> {
        let of = |(i, guest): (usize, &Guest<'a>)| {
            let (baker, fitted) = (guest.baker, guest.fitted);
            Cards {
                model: &baker.tree.model,
                groups: &fitted.plan.cards,
                density: baker.density(fitted.request),
                samples: baker.recipe.samples,
                pad: baker.recipe.gutter_texels * GUTTER,
                lone: &self.lone[i],
                kin: &self.kin[i],
                fitted: share::Fitted {
                    foliage: &fitted.foliage,
                    opacity: &self.opacity[i],
                },
            }
        };
        self.guests.iter().enumerate().map(of).collect()
    }
}

/// Levels on one page, not yet complete.
pub struct Page {
    shared: Shared,
    matched: Matched,
    /// Which charts are whose.
    charts: Vec<Range<usize>>,
}

impl Page {
    /// Texels along a line over those that levels should have; 1 or less.
    pub fn finer(&self) -> f32 {
        self.shared.finer
    }

    /// A level for each guest, all with the same images: maps of light are coarser.
    pub fn levels(mut self, guests: &[Guest]) -> Vec<Level> {
        self.shared.foliage.bleed();
        let mut images = self.shared.foliage.take_images();
        let halvings = guests
            .iter()
            .map(|g| g.baker.recipe.shared_light_halvings());
        coarsen_light(&mut images, halvings.min().unwrap_or(0));
        let Shared {
            foliage,
            finer,
            farthest,
        } = &self.shared;
        let material = |first: u32| foliage.maps.material(first, true);
        let level = |(guest, charts): (&Guest, Range<usize>)| {
            let fitted = guest.fitted;
            let surface = foliage.surface(charts.clone());
            Level {
                scene: on_page(fitted.wood.clone(), surface, images.clone(), material),
                request: fitted.request,
                plan: fitted.plan.clone(),
                matched: self.matched.clone(),
                charts: foliage.charts[charts].to_vec(),
                atlas: foliage.size,
                density: guest.baker.density(fitted.request) * finer,
                farthest_copy: *farthest,
                shared: Vec::new(),
            }
        };
        let mut levels: Vec<Level> = guests.iter().zip(self.charts.clone()).map(level).collect();
        let originals: Vec<&Original> = guests.iter().map(|g| g.baker.original).collect();
        toned(&mut levels, &originals);
        levels
    }
}
