//! What sharing of texels saved and cost: a table, and the tiles with the cards that show pieces of them.

use maud::{Markup, html};

use super::embed::data_uri;
use super::tables::{bytes, table};
use crate::report::schema::{SharedLevel, Sharing};

/// Tiles and their copies on a level's page, as a PNG.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// The level's number.
    pub level: u32,
    /// PNG.
    pub png: Vec<u8>,
}

/// Whether any level shares, so that there is something to tell.
pub fn any(sharing: &Sharing) -> bool {
    let shares = |level: &SharedLevel| level.copies > 0 || level.smaller_page;
    sharing.levels.iter().any(shares)
}

/// What was shared, level by level.
pub fn section(sharing: &Sharing, sheets: &[Sheet]) -> Markup {
    html! {
        section id="sharing" aria-labelledby="sharing-title" {
            h2 id="sharing-title" { "Shared texels" }
            (rows(sharing))
            @for level in sharing.levels.iter().filter(|l| l.copies == 0 && !l.smaller_page && l.tiles > 0) {
                p { "Level " (level.level) " keeps its page: on smaller ones it loses more F1 than it may." }
            }
            @for sheet in sheets {
                figure {
                    img class="wide" src=(data_uri(&sheet.png)) alt={ "Level " (sheet.level) ": tiles, and beside each the cards that show a piece of it" };
                    figcaption { "Level " (sheet.level) ": a tile in each row (on sand) and cards that show a piece of it (on blue)." }
                }
            }
        }
    }
}

fn rows(sharing: &Sharing) -> Markup {
    table(
        "What cards that look alike save and cost where they share texels. A copy's error is the squared difference from \
         what it should look like, over that of an empty card.",
        &[
            "level",
            "cards",
            "copies",
            "classes",
            "worst copy",
            "texels along a line",
            "textures",
            "without",
            "F1",
            "without",
        ],
        html! {
            @for level in &sharing.levels {
                tr {
                    th scope="row" { (level.level) }
                    td { (level.tiles + level.copies) }
                    td { (level.copies) }
                    td { (level.classes) }
                    td { (format!("{:.2}", level.farthest_copy)) }
                    td { (format!("{:.2}", level.density)) }
                    td { (bytes(level.texture_bytes_with)) }
                    td { (bytes(level.texture_bytes_without)) }
                    td { (format!("{:.3}", level.f1_with)) }
                    td { (format!("{:.3}", level.f1_without)) }
                }
            }
            tr {
                th scope="row" { "all" }
                td colspan="5" {}
                td { (bytes(sharing.texture_bytes_with)) }
                td { (bytes(sharing.texture_bytes_without)) }
                td { (format!("{:.3}", sharing.f1_with)) }
                td { (format!("{:.3}", sharing.f1_without)) }
            }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_that_share_are_told_with_their_sheets_and_those_that_cannot() {
        let shared = SharedLevel {
            level: 1,
            tiles: 30,
            copies: 70,
            classes: 12,
            farthest_copy: 0.625,
            density: 0.5,
            smaller_page: true,
            texture_bytes_with: 1 << 20,
            texture_bytes_without: 4 << 20,
            f1_with: 0.912,
            f1_without: 0.917,
        };
        let kept = SharedLevel {
            level: 2,
            tiles: 5,
            density: 1.0,
            ..SharedLevel::default()
        };
        let sharing = Sharing {
            texture_bytes_with: 1 << 20,
            texture_bytes_without: 4 << 20,
            levels: vec![shared, kept],
            ..Sharing::default()
        };
        let sheet = Sheet {
            level: 1,
            png: vec![1, 2, 3],
        };
        let page = section(&sharing, &[sheet]).into_string();
        for part in [
            "<td>100</td><td>70</td><td>12</td><td>0.62</td>",
            "0.912",
            "data:image/png;base64,AQID",
            "Level 2 keeps",
        ] {
            assert!(page.contains(part), "{part} in {page}");
        }
        assert!(any(&sharing));
        let nothing = Sharing {
            levels: sharing.levels[1..].to_vec(),
            ..sharing
        };
        assert!(!any(&nothing));
    }
}
