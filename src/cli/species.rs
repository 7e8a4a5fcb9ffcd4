//! `pleach bake --species`: trees of one species become one package.

use std::time::Instant;

use super::bake_table::{head, line};
use super::out::{print, say};
use super::progress::Bars;
use crate::error::Result;
use crate::report::species::SpeciesReport;
use crate::species::{BakedSpecies, Species, bake_species, to_json};
use crate::threads::pool;

/// Bakes the species and says what came of it.
pub fn run(species: &Species, threads: usize, quiet: bool, json: bool) -> Result<()> {
    let started = Instant::now();
    let bars = Bars::new(quiet);
    let baked = pool(threads)?.install(|| bake_species(species, &bars));
    bars.finish();
    let baked = baked?;
    for warning in baked.warnings.iter().filter(|_| !quiet) {
        say(format_args!("warning: {warning}"));
    }
    if json {
        print(&(to_json(&baked.report)? + "\n"))
    } else if !quiet {
        let seconds = started.elapsed().as_secs_f64();
        let folder = species.request.output.display();
        let files = baked.files.len();
        let end = format!("\n{files} files in {folder} after {seconds:.1} s.\n");
        print(&(table(&baked) + &end))
    } else {
        Ok(())
    }
}

fn table(baked: &BakedSpecies) -> String {
    let mut out = head();
    let levels = baked.report.trees.iter().flat_map(|t| &t.report.levels);
    levels.for_each(|level| out += &line(level));
    out + "\n" + &pages(&baked.report)
}

/// One line a page.
fn pages(report: &SpeciesReport) -> String {
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let mut out = String::new();
    for page in &report.pages {
        out += &format!("page {}, {} px: ", page.page, page.height_px);
        if !page.shared {
            out += "not shared, each level keeps its own: no page of all was found on which each loses little enough\n";
            continue;
        }
        let lost = page.trees.iter().map(|t| t.f1_without - t.f1_with);
        out += &format!(
            "{} x {} texels for {} levels, {:.2} as fine; {} of {} cards show pieces of others, {} of another tree's; \
             {:.1} MB for {:.1}; F1 {:+.3} at most\n",
            page.size[0],
            page.size[1],
            page.trees.len(),
            page.density,
            page.copies,
            page.copies + page.tiles,
            page.copies_of_others,
            mib(page.bytes_with),
            mib(page.bytes_without),
            -lost.fold(f64::NEG_INFINITY, f64::max),
        );
    }
    out + &format!(
        "All pages: {:.1} MB for {:.1}.\n",
        mib(report.page_bytes_with),
        mib(report.page_bytes_without)
    )
}
