//! One page for the levels of several trees that start at one size.

use crate::error::Result;
use crate::export::chart::{Chart, Shape};
use crate::export::png::encode_png;
use crate::export::share::{owners, sheet};
use crate::level::{Baker, Fitted, Guest, Level, Table, half};
use crate::prepared::Prepared;
use crate::report::schema::Figure;
use crate::report::species::{SharedPage, SharedTree, SpeciesReport};
use crate::sharing::{Ruler, within};
use crate::watch::{Watch, part};

/// A tree's level with texels of its own.
pub struct Candidate {
    /// Whose it is.
    pub tree: usize,
    /// The level.
    pub fitted: Fitted,
}

/// Levels as they are written.
#[derive(Default)]
pub struct Seated {
    /// Whose level each is.
    pub levels: Vec<(usize, Level)>,
    /// Whether they share a page.
    shared: bool,
    /// F1 of each where it starts: as it is written, and on a page of its own.
    f1: Vec<[f64; 2]>,
    /// Texels along a line over those of pages of their own.
    density: f64,
    bytes_without: u64,
}

/// The levels on the smallest page on which none loses more F1 than the recipe allows where it starts; on
/// pages of their own where there is none. `rulers` measure the trees at this size, by their number.
///
/// # Errors
/// Those of writing and reading levels.
pub fn seat(
    candidates: Vec<Candidate>,
    bakers: &[Baker],
    rulers: &[Ruler],
    height_px: u32,
    watch: &dyn Watch,
) -> Result<Seated> {
    let alone = |c: &Candidate| bakers[c.tree].alone(c.fitted.clone());
    let mut bytes_without = 0;
    let mut figures: Vec<Figure> = Vec::with_capacity(candidates.len());
    for c in &candidates {
        let level = alone(c);
        bytes_without += page_bytes(&level);
        figures.push(rulers[c.tree].measure(&level, height_px)?.0);
    }
    let mut seated = Seated {
        f1: figures.iter().map(|f| [f.mean; 2]).collect(),
        bytes_without,
        density: 1.0,
        ..Seated::default()
    };
    let guests: Vec<Guest> = candidates
        .iter()
        .map(|c| Guest {
            baker: &bakers[c.tree],
            fitted: &c.fitted,
        })
        .collect();
    if !guests.is_empty() {
        let table = Table::new(&guests);
        let mut size = table.whole_page();
        while let Some(page) = table.seat(size, watch)? {
            let finer = page.finer();
            let levels = page.levels(&guests);
            part(watch, "share")?;
            let mut f1 = Vec::with_capacity(levels.len());
            for ((level, c), without) in levels.iter().zip(&candidates).zip(&figures) {
                let (with, _) = rulers[c.tree].measure(level, height_px)?;
                if !within(&with, without, bakers[c.tree].recipe.sharing) {
                    break;
                }
                f1.push([with.mean, without.mean]);
            }
            if f1.len() < levels.len() {
                break;
            }
            let trees = candidates.iter().map(|c| c.tree);
            seated.levels = trees.zip(levels).collect();
            (seated.shared, seated.f1, seated.density) = (true, f1, finer.into());
            if !half(&mut size) {
                break;
            }
        }
    }
    if !seated.shared {
        let single = |c: &Candidate| (c.tree, bakers[c.tree].as_if_shared(alone(c)));
        seated.levels = candidates.iter().map(single).collect();
    }
    Ok(seated)
}

/// A card that shows texels of another: its tree and number, and those of the other.
pub struct Copied {
    /// The tree and the card in its level.
    pub card: (usize, u32),
    /// The tree and the card whose tile it shows.
    pub of: (usize, u32),
}

impl Seated {
    /// Whether the levels share a page.
    pub fn is_shared(&self) -> bool {
        self.shared
    }

    /// Who shows whose texels.
    pub fn copies(&self) -> Vec<Copied> {
        let Some((_, first)) = self.levels.first().filter(|_| self.shared) else {
            return Vec::new();
        };
        let number = |(tree, level): &(usize, Level)| {
            let tree = *tree;
            (0..level.charts.len() as u32).map(move |card| (tree, card))
        };
        let numbers: Vec<(usize, u32)> = self.levels.iter().flat_map(number).collect();
        let owners = owners(&self.charts(), first.atlas);
        let copies = numbers.iter().zip(owners).filter_map(|(&card, owner)| {
            let of = numbers[owner? as usize];
            Some(Copied { card, of })
        });
        copies.collect()
    }

    fn charts(&self) -> Vec<Chart> {
        let all = self.levels.iter().flat_map(|(_, level)| &level.charts);
        all.cloned().collect()
    }

    /// Tiles with the cards that show pieces of them, as a PNG; `None` where there are none.
    pub fn sheet(&self) -> Result<Option<Vec<u8>>> {
        let charts = self.charts();
        let any = self.shared && charts.iter().any(|c| c.shape == Shape::Window);
        let page = self.levels.first().filter(|_| any);
        let page = page.and_then(|(_, level)| level.page());
        page.map(|page| {
            let owners = owners(&charts, [page.width, page.height]);
            encode_png(&sheet(&charts, &owners, page))
        })
        .transpose()
    }

    /// What is told of the page; `numbers` are those of the trees' levels.
    pub fn told(&self, trees: &[Prepared], numbers: &[usize], copies: &[Copied]) -> SharedPage {
        let size = match self.shared {
            true => self.levels.first().map_or([0; 2], |(_, level)| level.atlas),
            false => [0; 2],
        };
        let cards: usize = self.levels.iter().map(|(_, l)| l.charts.len()).sum();
        let tree = |((tree, _), f1): (&(usize, Level), &[f64; 2])| SharedTree {
            name: trees[*tree].tree.model.name.clone(),
            level: numbers[*tree] as u32,
            f1_with: f1[0],
            f1_without: f1[1],
        };
        SharedPage {
            shared: self.shared,
            size,
            density: self.density,
            tiles: (cards - copies.len()) as u64,
            copies: copies.len() as u64,
            copies_of_others: copies.iter().filter(|c| c.card.0 != c.of.0).count() as u64,
            bytes_with: match self.shared {
                true => self.levels.first().map_or(0, |(_, l)| page_bytes(l)),
                false => self.levels.iter().map(|(_, l)| page_bytes(l)).sum(),
            },
            bytes_without: self.bytes_without,
            trees: self.levels.iter().zip(&self.f1).map(tree).collect(),
            ..SharedPage::default()
        }
    }
}

/// Bytes of an image as a GPU holds it, uncompressed with all mips.
fn image_bytes([mut w, mut h]: [u32; 2]) -> u64 {
    let mut texels = u64::from(w) * u64::from(h);
    while w > 1 || h > 1 {
        (w, h) = ((w / 2).max(1), (h / 2).max(1));
        texels += u64::from(w) * u64::from(h);
    }
    4 * texels
}

/// Bytes of the images of a level's page.
fn page_bytes(level: &Level) -> u64 {
    let images = level.page_images().iter();
    images.map(|i| image_bytes([i.width, i.height])).sum()
}

/// Adds up the pages, and says what the report measured of the written files: what pages were chosen by may differ from
/// that by a sample or two (.00001 of F1 in one case).
pub fn add_up(report: &mut SpeciesReport) {
    let written = |t: &SharedTree| {
        let tree = report.trees.iter().find(|tree| tree.name == t.name)?;
        let level = tree.report.levels.get(t.level.checked_sub(1)? as usize)?;
        Some(level.sizes.first()?.f1.mean)
    };
    for tree in report.pages.iter_mut().flat_map(|page| &mut page.trees) {
        tree.f1_with = written(tree).unwrap_or(tree.f1_with);
    }
    let sum = |of: fn(&SharedPage) -> u64| report.pages.iter().map(of).sum();
    (report.page_bytes_with, report.page_bytes_without) =
        (sum(|p| p.bytes_with), sum(|p| p.bytes_without));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_held_with_all_mips() {
        assert_eq!(image_bytes([1, 1]), 4);
        // 4 x 2, 2 x 1, 1 x 1.
        assert_eq!(image_bytes([4, 2]), 4 * (8 + 2 + 1));
        assert_eq!(image_bytes([0, 0]), 0);
    }
}
