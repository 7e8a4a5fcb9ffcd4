//! What `pleach bake` prints: a line a level, and what else is in the package.

use crate::pipeline::{Baked, Request};
use crate::report::schema::{Bake, Level, Sharing};

/// One line a level.
pub(super) fn table(baked: &Baked, took: &Bake, request: &Request) -> String {
    let mut out = head();
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    if let Some(original) = &baked.report.original {
        out += &format!(
            "{:<28}{:>10}{:>7}{:>9.1}{:>10.1}\n",
            original.file,
            original.triangles,
            original.draw_calls,
            mib(original.texture_bytes),
            0.0
        );
    }
    for level in &baked.report.levels {
        out += &line(level);
    }
    if let Some(sharing) = &baked.report.sharing
        && sharing.texture_bytes_with < sharing.texture_bytes_without
    {
        out += &shared(sharing);
    }
    if let Some(instanced) = &baked.report.instancing {
        out += &format!(
            "\n{}: {} of {} leaves are copies of {}; {:.1} MB, written out {:.1} MB\n",
            instanced.file,
            instanced.copies,
            instanced.leaves,
            instanced.prototypes,
            mib(instanced.file_bytes),
            mib(instanced.plain_file_bytes),
        );
    }
    if let Some(hierarchy) = &baked.report.hierarchy {
        out += &format!(
            "\n{}, {}: {} tiles, {} billboard triangles on {} x {} texels\n",
            hierarchy.file,
            hierarchy.tileset,
            hierarchy.tiles,
            hierarchy.billboard_triangles,
            hierarchy.atlas[0],
            hierarchy.atlas[1],
        );
    }
    out += &format!(
        "\n{} files in {} after {:.1} s",
        baked.files.len(),
        request.output.display(),
        took.seconds
    );
    if let Some(peak) = took.peak_bytes {
        out += &format!(", peak memory {:.0} MB", mib(peak));
    }
    out + ".\nE: error over that of the original moved by half a pixel; 1 is as near as that. Area: covered, over the original's.\n"
}

fn shared(sharing: &Sharing) -> String {
    let mut out = String::from("\n");
    for level in sharing
        .levels
        .iter()
        .filter(|l| l.texture_bytes_with < l.texture_bytes_without)
    {
        out += &format!(
            "level {}: {} of {} cards show pieces of {} others, texels {:.2} as fine; {:.1} MB of textures for {:.1}, F1 {:.3} for {:.3}\n",
            level.level,
            level.copies,
            level.copies + level.tiles,
            level.classes,
            level.density,
            level.texture_bytes_with as f64 / 1_048_576.0,
            level.texture_bytes_without as f64 / 1_048_576.0,
            level.f1_with,
            level.f1_without,
        );
    }
    out
}

/// Names of the columns of [`line`].
pub(super) fn head() -> String {
    format!(
        "{:<28}{:>10}{:>7}{:>9}{:>10}{:>7}{:>8}{:>7}{:>7}{:>7}\n",
        "level", "triangles", "draws", "tex MB", "from m", "at px", "F1", "worst", "E", "area"
    )
}

pub(super) fn line(level: &Level) -> String {
    let head = format!(
        "{:<28}{:>10}{:>7}{:>9.1}{:>10.1}",
        level.file,
        level.triangles,
        level.draw_calls,
        level.texture_bytes as f64 / 1_048_576.0,
        level.distance_m
    );
    let figures = level.sizes.first().map(|size| {
        format!(
            "{:>7}{:>8.3}{:>7.3}{:>7.2}{:>7.3}",
            size.height_px, size.f1.mean, size.f1.worst, size.shift_ratio, size.area_ratio.mean
        )
    });
    head + &figures.unwrap_or_default() + "\n"
}
