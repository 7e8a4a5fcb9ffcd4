//! `pleach evaluate`: figures and pictures of levels against their original, from the files.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::evaluate_folder::{Evaluated, file_name};
use super::out::print;
use super::progress::{Bars, catch_ctrl_c};
use crate::botany::Model;
use crate::botany::load::load;
use crate::error::Result;
use crate::pipeline::to_json;
use crate::report::schema::{Figure, Level, Report, SizeFigures};
use crate::report::{Cuts, Settings, Start, evaluate_watched, start};
use crate::space::view::Lens;
use crate::watch::{Clock, begin, step};

/// Measures levels of detail against their original; takes any glTF, also another tool's.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The original tree (.glb or .gltf).
    original: PathBuf,
    /// The levels, nearest first. FILE@PIXELS: the tree's height from which a level is shown (files
    /// of pleach say so themselves); it is measured there and at half of it as well.
    #[arg(required = true, value_name = "LEVEL[@PIXELS]")]
    levels: Vec<String>,
    /// Folder for report.html, report.json and contact.png.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Heights of the tree on the screen, pixels.
    #[arg(long, value_delimiter = ',', default_value = "512,256,128,64,32", value_parser = clap::value_parser!(u32).range(4..=4096))]
    height: Vec<u32>,
    /// Number of views: equal azimuths at each elevation (one at least; one more at the first ones where they do not divide),
    /// and the top.
    #[arg(long, default_value_t = 26, value_parser = parse_views)]
    views: usize,
    /// Elevations of the views, degrees above the horizon.
    #[arg(long, value_delimiter = ',', default_value = "0,30,-15,60", allow_hyphen_values = true, value_parser = parse_elevation)]
    elevations: Vec<f32>,
    /// Azimuth of the first view, degrees; another offset gives another set of views.
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true)]
    azimuth_offset: f32,
    /// Draw the levels also as an engine does: box mips, alpha test, fourfold multisampling.
    #[arg(long)]
    client: bool,
    /// Look along parallel lines, as figures in the literature are made, not through the lens of a
    /// screen (that of the levels' scene, else 1080 lines and 60 degrees).
    #[arg(long)]
    orthographic: bool,
    /// Compare silhouettes alone: no colours, distances, normals and jumps; a fraction of the time.
    #[arg(long)]
    silhouettes: bool,
    /// Print the report as JSON instead of a table.
    #[arg(long)]
    json: bool,
}

fn parse_views(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=1000) => Ok(count),
        _ => Err("give a number of views from 1 to 1000".into()),
    }
}

fn parse_elevation(text: &str) -> std::result::Result<f32, String> {
    match text.trim().parse() {
        Ok(degrees @ -89.0..=89.0) => Ok(degrees),
        _ => Err("give degrees from -89 to 89".into()),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let started = Instant::now();
    catch_ctrl_c()?;
    let clock = Clock::new(Bars::default());
    begin(&clock, "load", 1)?;
    let original = load(&args.original)?;
    let (files, mut own_heights_px) = split(&args.levels);
    let told: Vec<Start> = files.iter().map(|file| start(file)).collect();
    for (told, height) in told.iter().zip(&mut own_heights_px) {
        *height = height.or(told.height_px);
    }
    let lens = match args.orthographic {
        true => Lens::Parallel,
        false => told.iter().find_map(|t| t.lens).unwrap_or_default(),
    };
    let levels: Vec<Model> = files.iter().map(|file| load(file)).collect::<Result<_>>()?;
    let settings = Settings {
        heights_px: args.height.clone(),
        own_heights_px,
        views: args.views,
        azimuth_offset_deg: args.azimuth_offset,
        elevations_deg: args.elevations.clone(),
        lens,
        client: args.client,
        appearance: !args.silhouettes,
        ..Settings::default()
    };
    let names: Vec<String> = files.iter().map(|file| file_name(file)).collect();
    let named: Vec<(&Model, &str)> = levels
        .iter()
        .zip(&names)
        .map(|(m, n)| (m, n.as_str()))
        .collect();
    begin(&clock, "measure", settings.view_set().len() as u64)?;
    let measured = evaluate_watched(
        (&original, &file_name(&args.original)),
        &named,
        &settings,
        &|| step(&clock),
    )?;
    let sizes = levels.iter().map(|model| model.triangles.len() as u64);
    let baked: Vec<(&Path, u64)> = files.iter().map(PathBuf::as_path).zip(sizes).collect();
    let report = Report {
        cuts: Cuts::beside(&baked),
        ..measured
    };
    if let Some(folder) = &args.output {
        let models: Vec<&Model> = levels.iter().collect();
        let evaluated = Evaluated {
            report: &report,
            files: (&args.original, &files),
            models: (&original, &models),
            settings: &settings,
            started,
        };
        evaluated.write(folder, &clock)?;
    }
    clock.inner().finish();
    if args.json {
        print(&(to_json(&report)? + "\n"))
    } else {
        print(&table(&report))
    }
}

/// Files and own heights of `FILE[@PIXELS]`.
fn split(levels: &[String]) -> (Vec<PathBuf>, Vec<Option<u32>>) {
    let (mut files, mut heights) = (Vec::new(), Vec::new());
    for level in levels {
        let parts = level.rsplit_once('@');
        match parts.and_then(|(file, px)| Some((file, px.parse().ok()?))) {
            Some((file, px @ 2..=4096)) => {
                files.push(PathBuf::from(file));
                heights.push(Some(px));
            }
            _ => {
                files.push(PathBuf::from(level));
                heights.push(None);
            }
        }
    }
    (files, heights)
}

/// The report for people: one line a level and size.
fn table(report: &Report) -> String {
    let mut out = format!(
        "{:<28}{:>10}{:>6}{:>10}{:>6}  {:<8}{:>6}{:>14}{:>7}{:>7}{:>7}{:>14}  worst view\n",
        "file",
        "triangles",
        "draws",
        "textures",
        "over",
        "drawn",
        "px",
        "F1 mean worst",
        "E",
        "prec",
        "recall",
        "area mean worst"
    );
    for level in report.original.iter().chain(&report.levels) {
        let mut head = format!(
            "{:<28}{:>10}{:>6}{:>10}{:>6.1}",
            level.file,
            level.triangles,
            level.draw_calls,
            bytes(level.texture_bytes),
            level.overdraw
        );
        for (how, figures) in lines(level) {
            out += &format!(
                "{head:<60}  {how:<8}{:>6}{:>8.3}{:>6.3}{:>7.2}{:>7.3}{:>7.3}{:>8.3}{:>6.2}  {}\n",
                figures.height_px,
                figures.f1.mean,
                figures.f1.worst,
                figures.shift_ratio,
                figures.precision.mean,
                figures.recall.mean,
                figures.area_ratio.mean,
                figures.area_ratio.worst,
                figures.f1.worst_view
            );
            head.clear();
        }
    }
    out += "\nE: error over that of the original moved by half a pixel; 1 is as near as that. Reference: 4 x 4 samples a pixel, more under 128 px.\n";
    out += &losses(report);
    if report.levels.iter().any(|l| l.orbit.is_some()) {
        out += &looks(report);
    }
    out
}

/// What a client costs the silhouettes, and what is to blame; nothing where that was not measured.
fn losses(report: &Report) -> String {
    let mut out = String::new();
    for level in &report.levels {
        for size in &level.sizes {
            let Some(client) = size.client.as_deref().filter(|c| !c.sampled.is_empty()) else {
                continue;
            };
            let lost = |f1: &Figure| size.f1.mean - f1.mean;
            let few = client
                .sampled
                .iter()
                .map(|few| format!("{:>8.3} with {}", lost(&few.f1), few.samples));
            let few: String = few.collect();
            out += &format!(
                "{:<28}{:>6}{:>8.3} in a client{few}\n",
                level.file,
                size.height_px,
                lost(&client.f1)
            );
        }
    }
    match out.is_empty() {
        true => out,
        false => format!(
            "\nF1 lost, means: in a client (mips, 4 samples of edges and 1 of alpha), with so few samples a pixel and no mips:\n{out}"
        ),
    }
}

/// Colours and what lies inside, and what changes: means over views.
fn looks(report: &Report) -> String {
    let mut out = format!(
        "\n{:<28}{:>6}{:>8}{:>9}{:>9}{:>7}{:>7}{:>7}{:>8}{:>8}{:>9}\n",
        "file",
        "px",
        "soft F1",
        "off 8",
        "off 32",
        "SSIM",
        "PSNR",
        "FLIP",
        "colour",
        "depth",
        "normals"
    );
    for level in &report.levels {
        for size in &level.sizes {
            let Some(look) = &size.appearance else {
                continue;
            };
            let inside = |f: &Option<Figure>| f.as_ref().map_or(f64::NAN, |f| f.mean);
            out += &format!(
                "{:<28}{:>6}{:>8.3}{:>8.1}%{:>8.1}%{:>7.3}{:>7.1}{:>7.3}{:>8.2}{:>8.3}{:>9.1}\n",
                level.file,
                size.height_px,
                look.soft_f1.mean,
                100.0 * look.incorrect_share_8.mean,
                100.0 * look.incorrect_share_32.mean,
                look.ssim.mean,
                look.psnr_db.mean,
                look.flip.mean,
                look.color_shift_delta_e.mean,
                inside(&look.depth_error),
                inside(&look.normal_error_deg),
            );
        }
    }
    out += "\nOff: pixels off by more than 8 or 32 of 255. PSNR in dB, colour in delta E, depth in tree heights, normals in degrees.\n";
    for level in &report.levels {
        if let Some(jump) = &level.jump_to_next {
            out += &format!(
                "{} to the next at {} px: F1 {:.3}, FLIP {:.3}, area {:.3}\n",
                level.file,
                jump.height_px,
                jump.f1.mean,
                jump.appearance.flip.mean,
                jump.area_ratio.mean
            );
        }
        if let Some(orbit) = &level.orbit {
            out += &format!(
                "{} turned by {} degree at {} px: FLIP {:.3}, the original {:.3}\n",
                level.file,
                orbit.step_deg,
                orbit.height_px,
                orbit.level.flip.mean,
                orbit.original.flip.mean
            );
        }
    }
    out
}

fn lines(level: &Level) -> impl Iterator<Item = (&'static str, &SizeFigures)> {
    level.sizes.iter().flat_map(|size| {
        let client = size.client.as_deref().map(|client| ("client", client));
        [("4x4", size)].into_iter().chain(client)
    })
}

fn bytes(count: u64) -> String {
    match count {
        0..1024 => format!("{count} B"),
        1024..1_048_576 => format!("{:.0} KiB", count as f64 / 1024.0),
        _ => format!("{:.1} MiB", count as f64 / 1_048_576.0),
    }
}
