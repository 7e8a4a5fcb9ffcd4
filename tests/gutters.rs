//! How much of a card's neighbours on the page a client shows, mip by mip, measured on written files.
//!
//! `PLEACH_LEVELS=a_LOD1.glb:b_LOD2.glb cargo test --release --test gutters -- --ignored --nocapture`
//! prints the figures of levels that were baked before.

use std::path::Path;
use std::process::Command;

use glam::{UVec2, Vec2};
use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;

/// An atlas page as a client gets it.
struct Page {
    size: UVec2,
    /// 0 to 1.
    alpha: Vec<f32>,
    /// Which card's triangles hold the texel's middle.
    owner: Vec<Option<usize>>,
    /// Texel bounds of each card.
    cards: Vec<[UVec2; 2]>,
}

/// What other cards give to what a card shows, over all texels of all cards.
#[derive(Clone, Copy, Debug, Default)]
struct Foreign {
    /// Share of the alpha that is read.
    alpha: f64,
    /// Share of the colour where alpha passes the test.
    color: f64,
}

impl Page {
    fn read(file: &Path) -> Self {
        let model = load(file).expect("a level");
        let foliage = |&t: &usize| model.material_of(t as u32).name == "foliage";
        let triangles: Vec<usize> = (0..model.triangles.len()).filter(foliage).collect();
        let texture = model.material_of(triangles[0] as u32).base_color;
        let texture = texture.expect("a page");
        let image = &model.images[texture.image as usize];
        let size = UVec2::new(image.width, image.height);
        let alpha = image.rgba.chunks(4).map(|t| f32::from(t[3]) / 255.0);
        let mut page = Self {
            size,
            alpha: alpha.collect(),
            owner: vec![None; (size.x * size.y) as usize],
            cards: Vec::new(),
        };
        let mut corner_of_last = None;
        for t in triangles {
            let corners = model.triangles[t];
            let uv = corners.map(|i| model.uvs[texture.uv_set as usize][i as usize]);
            let texels = uv.map(|p| p * size.as_vec2());
            // Triangles of one card are a fan of one corner.
            if corner_of_last.replace(corners[0]) != Some(corners[0]) {
                page.cards.push([size, UVec2::ZERO]);
            }
            page.draw(texels);
        }
        page
    }

    fn draw(&mut self, p: [Vec2; 3]) {
        let card = self.cards.len() - 1;
        let double = (p[1] - p[0]).perp_dot(p[2] - p[0]);
        let low = p[0].min(p[1]).min(p[2]).floor().as_uvec2();
        let high = p[0].max(p[1]).max(p[2]).ceil().as_uvec2().min(self.size);
        let bounds = &mut self.cards[card];
        *bounds = [bounds[0].min(low), bounds[1].max(high)];
        for y in low.y..high.y {
            for x in low.x..high.x {
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - p[0];
                let b = q.perp_dot(p[2] - p[0]) / double;
                let c = (p[1] - p[0]).perp_dot(q) / double;
                if b >= 0.0 && c >= 0.0 && b + c <= 1.0 {
                    self.owner[(y * self.size.x + x) as usize] = Some(card);
                }
            }
        }
    }

    /// What is read of a mip whose texels are `side` wide, at every texel of every card.
    fn foreign(&self, side: u32) -> Foreign {
        let (mut alpha, mut foreign_alpha) = (0.0, 0.0);
        let (mut shown, mut foreign_color) = (0.0, 0.0);
        for (card, &[low, high]) in self.cards.iter().enumerate() {
            let mip = |v: UVec2| (v / side).saturating_sub(UVec2::ONE);
            let first = mip(low);
            let count = (high / side + 2).min(self.size / side) - first;
            let cells = self.cells(card, first, count, side);
            for y in low.y..high.y {
                for x in low.x..high.x {
                    if self.owner[(y * self.size.x + x) as usize] != Some(card) {
                        continue;
                    }
                    let at = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32 - 0.5;
                    let [all, others, area] = bilinear(&cells, count, at - first.as_vec2());
                    alpha += all;
                    foreign_alpha += others;
                    if all >= 0.5 {
                        shown += 1.0;
                        foreign_color += area;
                    }
                }
            }
        }
        Foreign {
            alpha: foreign_alpha / f64::max(alpha, 1e-9),
            color: foreign_color / f64::max(shown, 1.0),
        }
    }

    /// Mip texels around a card: alpha, the part of it that is other cards', and their area.
    fn cells(&self, card: usize, first: UVec2, count: UVec2, side: u32) -> Vec<[f64; 3]> {
        let mut cells = vec![[0.0; 3]; (count.x * count.y) as usize];
        let (from, end) = (first * side, (first + count) * side);
        let share = 1.0 / f64::from(side * side);
        for y in from.y..end.y {
            for x in from.x..end.x {
                let at = (y * self.size.x + x) as usize;
                let cell = (y / side - first.y) * count.x + x / side - first.x;
                let cell = &mut cells[cell as usize];
                let alpha = f64::from(self.alpha[at]) * share;
                cell[0] += alpha;
                if self.owner[at].is_some_and(|owner| owner != card) {
                    cell[1] += alpha;
                    cell[2] += share;
                }
            }
        }
        cells
    }
}

fn bilinear(cells: &[[f64; 3]], count: UVec2, at: Vec2) -> [f64; 3] {
    let (floor, t) = (at.floor(), at - at.floor());
    let mut out = [0.0; 3];
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let most = count.as_vec2() - 1.0;
        let texel = (floor + Vec2::new(dx, dy))
            .clamp(Vec2::ZERO, most)
            .as_uvec2();
        let weight = (1.0 - dx - t.x).abs() * (1.0 - dy - t.y).abs();
        let cell = cells[(texel.y * count.x + texel.x) as usize];
        for (out, value) in out.iter_mut().zip(cell) {
            *out += f64::from(weight) * value;
        }
    }
    out
}

/// Mips 1 to 4.
fn report(file: &Path) -> [Foreign; 4] {
    let page = Page::read(file);
    let found = [2, 4, 8, 16].map(|side| page.foreign(side));
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let shares = found.map(|f| format!("{:.3} {:.3}", f.alpha, f.color));
    println!(
        "{name:32} {:?} alpha, colour: {}",
        page.size,
        shares.join(" | ")
    );
    found
}

#[test]
fn what_is_read_worked_by_hand() {
    // Two cards of 2 x 4 texels beside each other, all opaque; mip texels are 4 wide, so half of
    // what either card shows is the other's.
    let mut page = Page {
        size: UVec2::new(4, 4),
        alpha: vec![1.0; 16],
        owner: vec![None; 16],
        cards: Vec::new(),
    };
    for left in [0.0, 2.0] {
        page.cards.push([page.size, UVec2::ZERO]);
        let corner = |x: f32, y: f32| Vec2::new(left + x, y);
        page.draw([corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 4.0)]);
        page.draw([corner(0.0, 0.0), corner(2.0, 4.0), corner(0.0, 4.0)]);
    }
    let found = page.foreign(4);
    assert!(
        (found.alpha - 0.5).abs() < 1e-6 && (found.color - 0.5).abs() < 1e-6,
        "{found:?}"
    );
    // Mip texels of 2 belong to one card each, but the filter reads a quarter of the neighbour's
    // half of the time: texels at 0.5 and 1.5 of 2 read none and a quarter of it.
    assert!((page.foreign(2).alpha - 0.125).abs() < 1e-6);
}

#[test]
fn neighbours_on_the_page_stay_out_of_the_mips_of_a_levels_range() {
    let folder = tempfile::tempdir().expect("a folder");
    let tree = folder.path().join("oak.glb");
    let species = Species::named("oak").expect("a species");
    let options = Options {
        leaves: Some(700),
        ..Options::default()
    };
    let grown = grow(&species, &options).expect("an oak");
    std::fs::write(&tree, grown.glb).expect("a file");
    let package = folder.path().join("package");
    let status = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["bake", "--quiet", "--preset", "draft", "--accept"])
        .args(["--triangles", "500,100,24"])
        .arg(&tree)
        .arg("-o")
        .arg(&package)
        .status();
    assert!(status.expect("a bake").success());
    for level in 1..=3 {
        let found = report(&package.join(format!("oak_LOD{level}.glb")));
        // A level's range is from where it starts to twice that distance: the base and one mip.
        assert!(
            found[0].alpha < 0.001 && found[0].color < 0.001,
            "{found:?}"
        );
        assert!(found[1].alpha < 0.02 && found[1].color < 0.02, "{found:?}");
        // The last level has no end: four mips.
        if level == 3 {
            assert!(found[2].alpha < 0.02 && found[2].color < 0.02, "{found:?}");
            assert!(found[3].alpha < 0.1 && found[3].color < 0.1, "{found:?}");
        }
    }
}

#[test]
#[ignore = "a study: prints figures"]
fn levels_that_were_baked_before() {
    let files = std::env::var_os("PLEACH_LEVELS").expect("PLEACH_LEVELS names files");
    for file in std::env::split_paths(&files) {
        report(&file);
    }
}
