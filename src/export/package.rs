//! A package on disk: complete or absent.
//!
//! Files are written into a folder beside the output and moved to their place at the end. A bake
//! that fails or is stopped leaves what was there before. Files in the output folder that are not
//! the package's own are never removed.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::exchange::exchange;
use super::leftovers;
use super::manifest;
use super::manifest_files::files_of;
use crate::error::{Error, Result};

/// A package that is being written; dropped before [`Package::commit`], it leaves no trace.
#[derive(Debug)]
pub struct Package {
    /// Where it will be.
    output: PathBuf,
    /// Where it is written.
    draft: PathBuf,
    /// Folders above the output that did not exist, deepest first.
    made: Vec<PathBuf>,
    /// Files of the package that it replaces.
    old_files: Vec<String>,
    committed: bool,
}

impl Package {
    /// Starts a package for the folder `output`.
    ///
    /// # Errors
    /// [`Error::Usage`] where the folder holds other things than a package of ours, unless `force`;
    /// [`Error::Io`] where it can't be written. Both before any work is done.
    pub fn start(output: &Path, force: bool) -> Result<Self> {
        let output = std::path::absolute(output).map_err(|e| Error::io(output, "find", e))?;
        leftovers::clear(&output);
        let old_files = replaced(&output, force)?;
        let Some((parent, name)) = output.parent().zip(output.file_name()) else {
            return Err(Error::usage(
                format!("{} can't be a package's folder", output.display()),
                "name a folder with -o, such as out/oak",
            ));
        };
        let made = parent.ancestors().take_while(|p| !p.exists());
        let made = made.map(Path::to_path_buf).collect();
        let package = Self {
            draft: parent.join(leftovers::draft_name(name)),
            made,
            old_files,
            committed: false,
            output,
        };
        std::fs::create_dir_all(&package.draft)
            .map_err(|e| Error::io(&package.draft, "create", e))?;
        if package.output.exists() {
            package.probe()?;
        }
        Ok(package)
    }

    /// A folder may be listed and yet not be written to; that is known before the work, not after.
    fn probe(&self) -> Result<()> {
        let probe = self.output.join(format!(".pleach-{}", std::process::id()));
        std::fs::write(&probe, b"")
            .and_then(|()| std::fs::remove_file(&probe))
            .map_err(|e| Error::io(&self.output, "write into", e))
    }

    /// Writes one file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.write_pieces(name, [bytes].into_iter())
    }

    /// Writes one file: pieces that follow each other.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_pieces<'p>(
        &self,
        name: &str,
        mut pieces: impl Iterator<Item = &'p [u8]>,
    ) -> Result<()> {
        let written = File::create(self.draft.join(name))
            .and_then(|mut file| pieces.try_for_each(|piece| file.write_all(piece)));
        written.map_err(|e| Error::io(&self.output.join(name), "write", e))
    }

    /// Writes a file beside the package's folder, named after it; returns where. It stays.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_beside(&self, ending: &str, bytes: &[u8]) -> Result<PathBuf> {
        let file = beside(&self.output, ending);
        std::fs::write(&file, bytes).map_err(|e| Error::io(&file, "write", e))?;
        Ok(file)
    }

    /// Where a file that was written can be read back from.
    pub fn file(&self, name: &str) -> PathBuf {
        self.draft.join(name)
    }

    /// Moves the package to its place. `files` are all its files, the manifest last.
    ///
    /// # Errors
    /// [`Error::Io`]; then the old package is still in its place.
    pub fn commit(mut self, files: &[String]) -> Result<()> {
        // Another run may have put its package there meanwhile: what its manifest lists is replaced, too.
        let meanwhile = replaced(&self.output, true)?;
        self.old_files.extend(meanwhile);
        let fail = |e| Error::io(&self.output, "move the package to", e);
        if self.only_ours().map_err(fail)? {
            self.swap().map_err(fail)?;
        } else {
            self.merge(files).map_err(fail)?;
        }
        self.committed = true;
        Ok(())
    }

    /// Whether the output folder holds nothing but the old package's files (or doesn't exist).
    fn only_ours(&self) -> std::io::Result<bool> {
        if !self.output.exists() {
            return Ok(true);
        }
        // A link stays a link.
        if self.output.is_symlink() {
            return Ok(false);
        }
        for entry in std::fs::read_dir(&self.output)? {
            let name = entry?.file_name();
            if !self.old_files.iter().any(|f| name == f.as_str()) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Puts the draft folder where the output folder is, or is to be.
    fn swap(&self) -> std::io::Result<()> {
        // Where it fails, another run may have been quicker by a moment.
        if !self.output.exists() && std::fs::rename(&self.draft, &self.output).is_ok() {
            return Ok(());
        }
        if exchange(&self.draft, &self.output).is_ok() {
            return std::fs::remove_dir_all(&self.draft);
        }
        // Where the system can't: for a moment there is no package. `leftovers` puts it back if we
        // are killed just then.
        let mut old = self.draft.clone().into_os_string();
        old.push(leftovers::OLD);
        std::fs::rename(&self.output, &old)?;
        if let Err(error) = std::fs::rename(&self.draft, &self.output) {
            std::fs::rename(&old, &self.output)?;
            return Err(error);
        }
        std::fs::remove_dir_all(&old)
    }

    /// Moves file by file into a folder that holds other things too; the manifest comes last.
    fn merge(&self, files: &[String]) -> std::io::Result<()> {
        for name in files {
            std::fs::rename(self.draft.join(name), self.output.join(name))?;
        }
        for name in self.old_files.iter().filter(|n| !files.contains(n)) {
            match std::fs::remove_file(self.output.join(name)) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(e),
                _ => {}
            }
        }
        std::fs::remove_dir(&self.draft)
    }
}

/// The file beside a package's folder that is named after it.
pub fn beside(output: &Path, ending: &str) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_os_string();
    name.push(ending);
    output.with_file_name(name)
}

/// Removes what [`Package::write_beside`] has left for the folder `output`, if it has.
pub fn remove_beside(output: &Path, ending: &str) {
    // It is of no use any more, and harms nobody where it can't be removed.
    let _ = std::fs::remove_file(beside(output, ending));
}

impl Drop for Package {
    fn drop(&mut self) {
        if self.committed {
            return;
        }
        // Nothing more can be done where this fails; the error that led here is the one to tell.
        let _ = std::fs::remove_dir_all(&self.draft);
        for folder in &self.made {
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// Files of the package that lies in `output`; none where it is empty or absent.
fn replaced(output: &Path, force: bool) -> Result<Vec<String>> {
    let entries = match std::fs::read_dir(output) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::io(output, "open as a folder", e)),
    };
    let mut empty = true;
    let mut files = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| Error::io(output, "list", e))?;
        empty = false;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(manifest::SUFFIX)
            && let Some(owned) = files_of(&entry.path())
        {
            files.extend(owned);
        }
    }
    if empty || force || !files.is_empty() {
        return Ok(files);
    }
    Err(Error::usage(
        format!(
            "{} exists and holds files that pleach did not write",
            output.display()
        ),
        "choose another folder with -o, or add the package to this one with --force (other files in it are kept)",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    fn bake(output: &Path, force: bool, files: &[&str]) -> Result<()> {
        let package = Package::start(output, force)?;
        let mut all: Vec<String> = files.iter().map(|f| f.to_string()).collect();
        all.push("t.pleach.ron".into());
        for name in &all {
            let manifest = format!("(format: \"pleach\", files: {all:?})");
            package.write(name, manifest.as_bytes())?;
        }
        package.commit(&all)
    }

    #[test]
    fn a_dropped_package_leaves_no_trace() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("a/b/c");
        let package = Package::start(&output, false).unwrap();
        package.write("x", b"1").unwrap();
        drop(package);
        assert!(names(home.path()).is_empty());
    }

    #[test]
    fn an_own_package_is_replaced_and_its_old_files_go() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        bake(&output, false, &["a", "b"]).unwrap();
        bake(&output, false, &["a"]).unwrap();
        assert_eq!(names(&output), ["a", "t.pleach.ron"]);
        assert_eq!(names(home.path()), ["oak"]);
    }

    #[test]
    fn of_two_that_started_together_the_later_one_is_there_whole() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        let late = Package::start(&output, false).unwrap();
        late.write("a", b"late").unwrap();
        late.write("t.pleach.ron", b"late").unwrap();
        // A draft of the same process has the same name: the other one's is made by hand.
        std::fs::create_dir(&output).unwrap();
        for name in ["a", "b"] {
            std::fs::write(output.join(name), b"early").unwrap();
        }
        let manifest = "(format: \"pleach\", files: [\"a\", \"b\", \"t.pleach.ron\"])";
        std::fs::write(output.join("t.pleach.ron"), manifest).unwrap();
        late.commit(&["a".into(), "t.pleach.ron".into()]).unwrap();
        assert_eq!(names(&output), ["a", "t.pleach.ron"]);
        assert_eq!(std::fs::read(output.join("a")).unwrap(), b"late");
        assert_eq!(names(home.path()), ["oak"]);
    }

    #[test]
    fn a_note_beside_an_own_package_is_kept() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        bake(&output, false, &["a", "b"]).unwrap();
        std::fs::write(output.join("note"), b"mine").unwrap();
        bake(&output, false, &["a"]).unwrap();
        assert_eq!(names(&output), ["a", "note", "t.pleach.ron"]);
        assert_eq!(names(home.path()), ["oak"]);
    }

    #[test]
    fn a_foreign_folder_is_refused_without_force_and_kept_with_it() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        std::fs::create_dir(&output).unwrap();
        std::fs::write(output.join("thesis"), b"years").unwrap();
        std::fs::write(output.join("x.pleach.ron"), b"(format: \"other\")").unwrap();
        let refused = bake(&output, false, &["a"]).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        assert_eq!(names(home.path()), ["oak"]);
        bake(&output, true, &["a"]).unwrap();
        assert_eq!(
            names(&output),
            ["a", "t.pleach.ron", "thesis", "x.pleach.ron"]
        );
    }

    #[test]
    fn a_file_in_the_place_of_the_folder_is_an_error() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        std::fs::write(&output, b"").unwrap();
        assert_eq!(bake(&output, true, &["a"]).unwrap_err().exit_code(), 2);
        assert_eq!(
            bake(&output.join("deeper"), true, &[])
                .unwrap_err()
                .exit_code(),
            2
        );
    }
}
