//! `pleach bake --species`: trees of one species become one package.

use std::time::Instant;

use super::bake_table::{head, line};
use super::out::{print, say};
use super::progress::Bars;
use crate::error::Result;
use crate::report::species::SpeciesReport;
use crate::species::{Species, bake_species, standing, to_json};
use crate::threads::pool;

/// A species' package as it is at the end.
pub struct Standing {
    /// Its figures.
    pub report: SpeciesReport,
    /// How many files were written; `None`: those that are there are what a bake would make.
    pub written: Option<usize>,
}

/// Bakes the species and says what came of it.
pub fn run(species: &Species, rebake: bool, threads: usize, quiet: bool, json: bool) -> Result<()> {
    let started = Instant::now();
    let made = made(species, rebake, threads, quiet)?;
    if json {
        print(&(to_json(&made.report)? + "\n"))
    } else if !quiet {
        let seconds = started.elapsed().as_secs_f64();
        let folder = species.request.output.display();
        let end = match made.written {
            Some(files) => format!("\n{files} files in {folder} after {seconds:.1} s.\n"),
            None => format!("\n{folder} is unchanged, after {seconds:.1} s.\n"),
        };
        print(&(table(&made.report) + &end))
    } else {
        Ok(())
    }
}

/// Bakes the species unless its package stands already or is to be baked again.
pub fn made(species: &Species, rebake: bool, threads: usize, quiet: bool) -> Result<Standing> {
    if let (false, Some(report)) = (rebake, standing(species)) {
        let written = None;
        return Ok(Standing { report, written });
    }
    let bars = Bars::new(quiet);
    let baked = pool(threads)?.install(|| bake_species(species, &bars));
    bars.finish();
    let baked = baked?;
    for warning in baked.warnings.iter().filter(|_| !quiet) {
        say(format_args!("warning: {warning}"));
    }
    Ok(Standing {
        written: Some(baked.files.len()),
        report: baked.report,
    })
}

fn table(report: &SpeciesReport) -> String {
    let mut out = head();
    let levels = report.trees.iter().flat_map(|t| &t.report.levels);
    levels.for_each(|level| out += &line(level));
    out + "\n" + &pages(report)
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
