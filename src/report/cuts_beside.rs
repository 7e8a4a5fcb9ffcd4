//! The cuts that the bake of given level files chose from, as their package tells.

use std::path::Path;

use super::cuts::Cuts;
use super::schema::Report;
use crate::detail::optimal_cut::Candidate;

impl Cuts {
    /// What the bake of these level files (with their numbers of triangles) chose from, as the
    /// `report.json` beside them says; `None` where there is none that speaks of them. Levels that the
    /// report does not know, or knows otherwise, are left out.
    pub fn beside(levels: &[(&Path, u64)]) -> Option<Self> {
        let folder = levels.first()?.0.parent()?;
        let text = std::fs::read_to_string(folder.join("report.json")).ok()?;
        let report: Report = serde_json::from_str(&text).ok()?;
        let cuts = report.cuts?;
        let named = report.levels.iter().zip(&cuts.levels);
        let is_asked = |file: &str, triangles: u64| {
            levels.iter().any(|&(path, asked)| {
                path.parent() == Some(folder)
                    && path.file_name().is_some_and(|name| name == file)
                    && asked == triangles
            })
        };
        let known = named.filter(|(row, cut)| is_asked(&row.file, cut.triangles));
        let levels: Vec<Candidate> = known.map(|(_, cut)| *cut).collect();
        (!levels.is_empty()).then_some(Self {
            best: cuts.best,
            levels,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::schema::Level;

    #[test]
    fn a_report_beside_speaks_of_its_own_levels_alone() {
        let folder = tempfile::tempdir().unwrap();
        let cut = |triangles, error_m| Candidate { triangles, error_m };
        let row = |file: &str| Level {
            file: file.into(),
            ..Level::default()
        };
        let report = Report {
            levels: vec![row("a_LOD1.glb"), row("a_LOD2.glb")],
            cuts: Some(Cuts {
                best: vec![cut(100, 0.1), cut(10, 0.4), cut(2, 1.0)],
                levels: vec![cut(100, 0.09), cut(10, 0.3)],
            }),
            ..Report::default()
        };
        let text = serde_json::to_string(&report).unwrap();
        let [first, second, other] =
            ["a_LOD1.glb", "a_LOD2.glb", "b.glb"].map(|name| folder.path().join(name));
        assert_eq!(Cuts::beside(&[(&first, 100)]), None);
        std::fs::write(folder.path().join("report.json"), text).unwrap();
        // Another tool's file; one of that name with other contents.
        assert_eq!(Cuts::beside(&[(&other, 100)]), None);
        assert_eq!(Cuts::beside(&[(&first, 99)]), None);
        let found = Cuts::beside(&[(&other, 7), (&second, 10)]).unwrap();
        assert_eq!((found.best.len(), found.levels), (3, vec![cut(10, 0.3)]));
        std::fs::write(folder.path().join("report.json"), "{").unwrap();
        assert_eq!(Cuts::beside(&[(&first, 100)]), None);
    }
}
