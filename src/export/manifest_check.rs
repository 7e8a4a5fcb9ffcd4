//! Reads a manifest, and checks that it can be worked with: finite numbers, and sub-trees that are there.

use std::path::Path;

use serde::Deserialize;

use super::manifest::{Card, FORMAT, Level, Manifest, Subtree, VERSION};
use crate::error::{Error, Result};

impl Manifest {
    /// Reads a manifest's text.
    ///
    /// # Errors
    /// [`Error::Input`] with line and column where the text is no manifest (cut off, a key missing), with
    /// the version where that is another one, and with the field where a number is not finite or a
    /// sub-tree is missing.
    pub fn from_ron(text: &str, file: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Header {
            format: String,
            version: u32,
        }
        let fail =
            |place: String, what: String| Error::input(file, place, what, "bake the package again");
        let syntax = |e: ron::error::SpannedError| {
            let at = e.span.start;
            let place = format!("line {}, column {}", at.line, at.col);
            fail(place, e.code.to_string())
        };
        // Another version may lack keys: it is told from the header, before anything else is read.
        let header: Header = ron::from_str(text).map_err(syntax)?;
        if header.format != FORMAT || header.version != VERSION {
            let what = format!(
                "this is {:?} version {}, not {FORMAT:?} version {VERSION}",
                header.format, header.version
            );
            return Err(fail("version".into(), what));
        }
        let read: Self = ron::from_str(text).map_err(syntax)?;
        match flaw(&read) {
            Some((place, what)) => Err(fail(place, what)),
            None => Ok(read),
        }
    }
}

/// The first flaw: its field and what is wrong.
fn flaw(manifest: &Manifest) -> Option<(String, String)> {
    let tree = &manifest.tree;
    let numbers = [
        ("tree.height_m", tree.height_m),
        ("tree.radius_m", tree.radius_m),
        ("tree.center[0]", tree.center[0]),
        ("tree.center[1]", tree.center[1]),
        ("tree.center[2]", tree.center[2]),
    ];
    numbers
        .into_iter()
        .find_map(|(field, number)| finite(field.into(), number))
        .or_else(|| {
            let mut levels = manifest.levels.iter().enumerate();
            levels.find_map(|(i, level)| of_level(i, level, manifest.subtrees.len()))
        })
        .or_else(|| {
            let mut subtrees = manifest.subtrees.iter().enumerate();
            subtrees
                .find_map(|(i, s)| of_numbers(i, s).or_else(|| of_links(i, s, &manifest.subtrees)))
        })
        .or_else(|| {
            let measured = manifest
                .visibility
                .as_ref()?
                .measured(manifest.subtrees.len());
            measured
                .err()
                .map(|what| ("visibility.shares".into(), what))
        })
        .or_else(|| manifest.tiles.as_ref()?.flaw(manifest.subtrees.len()))
        .or_else(|| {
            let none = manifest.subtrees.is_empty();
            none.then(|| {
                (
                    "subtrees".into(),
                    "there is none, not even the whole tree".into(),
                )
            })
        })
}

fn finite(field: String, number: f64) -> Option<(String, String)> {
    (!number.is_finite()).then(|| (field, format!("{number} is not a finite number")))
}

fn of_level(index: usize, level: &Level, subtrees: usize) -> Option<(String, String)> {
    let at = |field: &str| format!("levels[{index}].{field}");
    // The end may be infinite: the last level never ends; so may level 0's size on the screen.
    let numbers = [
        ("error_m", level.error_m),
        ("error_px", level.error_px),
        ("range.distance_m", level.range.distance_m),
        ("range.fade_m[0]", level.range.fade_m[0]),
        ("range.fade_m[1]", level.range.fade_m[1]),
        ("range.screen_coverage", level.range.screen_coverage),
    ];
    let range = [
        ("range.end_m", level.range.end_m),
        ("range.screen_height", level.range.screen_height),
    ];
    numbers
        .into_iter()
        .find_map(|(field, number)| finite(at(field), number))
        .or_else(|| {
            let mut range = range.into_iter().filter(|(_, n)| n.is_nan());
            range
                .next()
                .map(|(field, n)| (at(field), format!("{n} is not a number")))
        })
        .or_else(|| {
            let mut cards = level.cards.iter().enumerate();
            cards.find_map(|(i, card)| of_card(&at(&format!("cards[{i}]")), card, subtrees))
        })
        .or_else(|| {
            let mut cards = level.cards.iter().enumerate();
            let own = |tile: u32| level.cards.get(tile as usize).map(|c| c.copy_of);
            cards.find_map(|(i, card)| match own(card.copy_of?) {
                // Of another tree, which has a manifest of its own.
                _ if card.copy_in.is_some() => None,
                Some(None) => None,
                _ => Some((
                    at(&format!("cards[{i}].copy_of")),
                    "it must be a card with texels of its own".into(),
                )),
            })
        })
}

fn of_card(at: &str, card: &Card, subtrees: usize) -> Option<(String, String)> {
    let numbers = [
        ("error_m", card.error_m),
        ("area_m2", card.area_m2),
        ("coverage_m2", card.coverage_m2),
        ("sigma", card.sigma),
        ("quality", card.quality),
        ("optimal_distance_m", card.optimal_distance_m),
    ];
    if card.subtree as usize >= subtrees {
        return Some((format!("{at}.subtree"), missing(card.subtree, subtrees)));
    }
    let corners = card
        .corners
        .iter()
        .flatten()
        .map(|&c| ("corners", f64::from(c)));
    numbers
        .into_iter()
        .chain(corners)
        .find_map(|(field, number)| finite(format!("{at}.{field}"), number))
}

fn missing(index: u32, count: usize) -> String {
    format!("there is no sub-tree {index}, only {count}")
}

fn of_numbers(index: usize, s: &Subtree) -> Option<(String, String)> {
    let own = s.own.iter().flat_map(|o| {
        let numbers = [
            ("own.radius_m", o.radius_m),
            ("own.optimal_distance_m", o.optimal_distance_m),
            ("own.geometric_distance_m", o.geometric_distance_m),
        ];
        numbers
            .into_iter()
            .chain(o.center.map(|c| ("own.center", c)))
    });
    let vectors = [
        ("connector", s.connector),
        ("center", s.center),
        ("branch", s.branch),
    ];
    let numbers = [
        ("radius_m", s.radius_m),
        ("optimal_distance_m", s.optimal_distance_m),
        ("geometric_distance_m", s.geometric_distance_m),
        ("density", s.density),
    ];
    let at = |field: &str| format!("subtrees[{index}].{field}");
    let sizes = numbers
        .into_iter()
        .chain(own.clone().filter(|(field, _)| *field != "own.center"));
    vectors
        .into_iter()
        .flat_map(|(field, v)| v.map(|c| (field, c)))
        .chain(numbers)
        .chain(own)
        .find_map(|(field, number)| finite(at(field), number.into()))
        .or_else(|| {
            let negative = sizes
                .filter(|(_, n)| *n < 0.0)
                .map(|(field, n)| (at(field), format!("{n} is negative")));
            negative.into_iter().next()
        })
        .or_else(|| {
            (s.density > 1.0).then(|| (at("density"), format!("{} is more than 1", s.density)))
        })
        .or_else(|| {
            let long = s.branch.iter().map(|c| c * c).sum::<f32>() > 1.001;
            long.then(|| (at("branch"), "it is longer than a unit vector".into()))
        })
}

fn of_links(index: usize, s: &Subtree, all: &[Subtree]) -> Option<(String, String)> {
    let at = |field: &str| format!("subtrees[{index}].{field}");
    match s.parent {
        None if index > 0 => {
            return Some((
                at("parent"),
                "only the whole tree, sub-tree 0, has none".into(),
            ));
        }
        Some(p) if p as usize >= all.len() => return Some((at("parent"), missing(p, all.len()))),
        Some(p) if p as usize >= index => {
            return Some((at("parent"), format!("sub-tree {p} doesn't come before it")));
        }
        Some(p)
            if all[p as usize]
                .children
                .binary_search(&(index as u32))
                .is_err() =>
        {
            return Some((
                at("parent"),
                format!("sub-tree {p} doesn't name it as a child"),
            ));
        }
        _ => {}
    }
    let first = all.get(s.representative as usize);
    if s.representative as usize > index
        || first.is_none_or(|f| f.representative != s.representative)
    {
        let what = format!("sub-tree {} is not the first of its kind", s.representative);
        return Some((at("representative"), what));
    }
    let mut carried = 0u64;
    for &child in &s.children {
        match all.get(child as usize) {
            None => return Some((at("children"), missing(child, all.len()))),
            Some(c) if c.parent != Some(index as u32) => {
                return Some((
                    at("children"),
                    format!("sub-tree {child} has another parent"),
                ));
            }
            Some(c) => carried += u64::from(c.leaves),
        }
    }
    (carried > u64::from(s.leaves)).then(|| {
        let what = format!("{} are fewer than its children carry ({carried})", s.leaves);
        (at("leaves"), what)
    })
}
