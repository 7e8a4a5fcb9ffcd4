//! How full the packers make the atlas pages of packages that were baked before.
//!
//! `cargo bench --features xatlas --bench pack -- DIR/NAME.pleach.ron...` lays the cards of every
//! level out again, in rectangles and by their outlines, and prints which share of the page they are.

use std::path::Path;
use std::time::Instant;

use glam::{Vec2, Vec3};
use pleach::cloud::card::Card;
use pleach::export::atlas::{Layout, lay_out};
use pleach::export::manifest::{Level, Manifest};
use pleach::recipe::Packer;

fn main() {
    let files = std::env::args()
        .skip(1)
        .filter(|a| a.ends_with(".pleach.ron"));
    for file in files {
        let text = std::fs::read_to_string(&file).expect("a manifest");
        let manifest = Manifest::from_ron(&text, Path::new(&file)).expect("a manifest");
        for level in manifest.levels.iter().filter(|l| !l.cards.is_empty()) {
            row(&manifest, level);
        }
    }
}

/// The card in metres; the written outline says nothing of its coordinates.
fn card(corners: &[[f32; 3]]) -> Card {
    let p: Vec<Vec3> = corners.iter().map(|&c| Vec3::from(c)).collect();
    let u = (p[1] - p[0]).normalize_or(Vec3::X);
    let normal = (p[1] - p[0])
        .cross(p[2] - p[0])
        .normalize_or(u.any_orthonormal_vector());
    let v = normal.cross(u);
    let flat = |q: Vec3| Vec2::new((q - p[0]).dot(u), (q - p[0]).dot(v));
    Card {
        origin: p[0],
        u,
        v,
        outline: p.iter().map(|&q| flat(q)).collect(),
    }
}

fn row(manifest: &Manifest, level: &Level) {
    let cards: Vec<Card> = level.cards.iter().map(|c| card(&c.corners)).collect();
    let whole = cards[0].outline.len() == 4;
    let texels_px = (level.range.height_px as f32).max(if whole { 64.0 } else { 256.0 });
    let density = texels_px / manifest.tree.height_m as f32;
    let used: f64 = cards
        .iter()
        .map(|c| f64::from(c.area() * density * density))
        .sum();
    for packer in [Packer::Rectangles, Packer::Outlines] {
        if packer.check().is_err() {
            continue;
        }
        let layout = Layout {
            density,
            pad: 1.0,
            packer,
        };
        let began = Instant::now();
        let (_, [w, h]) = lay_out(&cards.iter().collect::<Vec<_>>(), &[], layout);
        println!(
            "{:36} {:6} cards  {:10}  {w:4} x {h:4}  {:.3} used  {:5.2} s",
            level.file,
            cards.len(),
            format!("{packer:?}"),
            used / (f64::from(w) * f64::from(h)),
            began.elapsed().as_secs_f64()
        );
    }
}
