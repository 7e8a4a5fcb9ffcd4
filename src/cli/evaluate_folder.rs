//! What `evaluate -o` writes: a page, the figures, contact sheets. All is drawn before anything is written.

use std::path::{Path, PathBuf};
use std::time::Instant;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use crate::botany::Model;
use crate::botany::load::load;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::error::{Error, Result};
use crate::pipeline::{recognised, to_json};
use crate::report::schema::{Bake, Report};
use crate::report::{Content, Made, Recognised, Settings, contact_sheet};
use crate::space::raster::Sampling;
use crate::space::view::View;
use crate::watch::{Clock, Watch, begin, step};

/// An evaluation to be shown.
pub struct Evaluated<'a> {
    /// The figures.
    pub report: &'a Report,
    /// The original's file and the levels', as they were given.
    pub files: (&'a Path, &'a [PathBuf]),
    /// The same, loaded.
    pub models: (&'a Model, &'a [&'a Model]),
    /// How it was evaluated.
    pub settings: &'a Settings,
    /// When the command began.
    pub started: Instant,
}

impl Evaluated<'_> {
    /// Draws everything and writes it to `folder`.
    ///
    /// # Errors
    /// Those of files, and [`Error::Interrupted`] before any is written.
    pub fn write<W: Watch>(&self, folder: &Path, clock: &Clock<W>) -> Result<()> {
        begin(clock, "recognise", 1)?;
        let recognised = recognised_in(self.files.0)?;
        let stages = clock.finish();
        let took = Bake {
            seconds: self.started.elapsed().as_secs_f64(),
            peak_bytes: stages.iter().map(|s| s.peak_bytes).max().filter(|&b| b > 0),
            stages,
        };
        let mut files = vec![
            ("report.json", (to_json(self.report)? + "\n").into_bytes()),
            ("report.html", self.page(&recognised, &took)?.into_bytes()),
            ("contact.png", self.contact(Sampling::REFERENCE)?),
        ];
        if self.settings.client {
            files.push(("contact-client.png", self.contact(Sampling::CLIENT)?));
        }
        step(clock)?;
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        for (name, bytes) in files {
            let file = folder.join(name);
            std::fs::write(&file, bytes).map_err(|e| Error::io(&file, "write", e))?;
        }
        Ok(())
    }

    fn page(&self, recognised: &[Recognised], took: &Bake) -> Result<String> {
        let (original, levels) = self.files;
        let all = [original]
            .into_iter()
            .chain(levels.iter().map(PathBuf::as_path));
        let sizes = all.map(|file| {
            let about = std::fs::metadata(file).map_err(|e| Error::io(file, "read", e))?;
            Ok((file_name(file), about.len()))
        });
        let page = Content {
            report: self.report,
            original: self.models.0,
            levels: self.models.1,
            views: &self.settings.view_set(),
            lens: self.settings.lens,
            sheets: &[],
            made: Some(Made {
                title: "Behind the figures",
                recognised,
                took,
                files: &sizes.collect::<Result<Vec<_>>>()?,
            }),
        };
        page.html()
    }

    /// Original and levels from some views, as a PNG.
    fn contact(&self, sampling: Sampling) -> Result<Vec<u8>> {
        let (original, levels) = self.models;
        let height_px = self.settings.heights_px.first().copied().unwrap_or(256);
        let seen_at = (self.settings.lens, height_px);
        let (width, height, rgba) =
            contact_sheet(original, levels, &self.shown(), seen_at, sampling);
        let mut png = Vec::new();
        let encoder = PngEncoder::new(&mut png);
        let encoded = encoder.write_image(&rgba, width, height, ExtendedColorType::Rgba8);
        encoded.map_err(|error| Error::Internal {
            step: "contact sheet",
            what: error.to_string(),
        })?;
        Ok(png)
    }

    /// The first view, one from above, the last level's worst one, and the top.
    fn shown(&self) -> Vec<View> {
        let last = self.report.levels.last();
        let size = last.and_then(|level| level.sizes.first());
        let worst = size.map(|size| size.f1.worst_view.as_str());
        let all = self.settings.view_set();
        let above = all.iter().position(|v| v.elevation_deg == 30.0);
        let keep = |(i, view): &(usize, View)| {
            *i == 0 || Some(*i) == above || Some(view.name.as_str()) == worst || view.name == "top"
        };
        let kept = all.into_iter().enumerate().filter(keep);
        kept.map(|(_, view)| view).collect()
    }
}

/// Pictures of what a bake would see in the original; none where that is no tree. It is read again
/// because recognition keeps what it is given, and drops what a bake does not need.
fn recognised_in(original: &Path) -> Result<Vec<Recognised>> {
    match recognise(load(original)?, &RecogniseOptions::default()) {
        Ok(tree) => recognised(&tree),
        Err(Error::Input { .. }) => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

/// The last part of a path.
pub(super) fn file_name(file: &Path) -> String {
    file.file_name()
        .unwrap_or(file.as_os_str())
        .to_string_lossy()
        .into_owned()
}
