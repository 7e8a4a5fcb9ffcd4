//! What went wrong, where, and what to do about it.

use std::path::{Path, PathBuf};

/// The result of every step.
pub type Result<T> = std::result::Result<T, Error>;

/// An error of a step; [`Error::exit_code`] says whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The input file can't be used as it is. `place` names mesh, primitive, accessor and index.
    #[error("{}: {place}: {what}\n  help: {help}", file.display())]
    Input {
        /// The file that was read.
        file: PathBuf,
        /// Where in the file: "mesh 3 (leaf), primitive 0, POSITION, index 17".
        place: String,
        /// What is wrong, with the numbers.
        what: String,
        /// What the user can do about it.
        help: String,
    },
    /// An argument or a recipe key that the user gave is wrong.
    #[error("{what}\n  help: {help}")]
    Usage {
        /// What is wrong.
        what: String,
        /// What the user can do about it.
        help: String,
    },
    /// A file can't be read or written.
    #[error("{}: {doing}: {source}{}", file.display(), way_out(source.kind()))]
    Io {
        /// The file or folder.
        file: PathBuf,
        /// What was being done with it: "open", "write".
        doing: &'static str,
        /// The operating system's answer.
        source: std::io::Error,
    },
    /// A baked level left its band; nothing was written in place of the package.
    #[error("bake refused: {what}\n  help: {help}")]
    Refused {
        /// Which level, which view, which figure.
        what: String,
        /// Which recipe key helps.
        help: String,
    },
    /// Trees of a batch failed.
    #[error("{what}")]
    Batch {
        /// Which, and why.
        what: String,
        /// The least of their exit codes.
        code: u8,
    },
    /// The user stopped the run (Ctrl-C).
    #[error("interrupted; nothing that was not finished was written")]
    Interrupted,
    /// A fault of ours.
    #[error(
        "internal error in {step}: {what}\n  help: this is a fault of pleach; please report it with the input file"
    )]
    Internal {
        /// The step that failed.
        step: &'static str,
        /// What it met.
        what: String,
    },
}

/// What helps against the commonest answers of an operating system.
fn way_out(kind: std::io::ErrorKind) -> &'static str {
    use std::io::ErrorKind;
    match kind {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "\n  help: make room, or write to another disk; what was there before is untouched"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "\n  help: change the permissions of the folder, or choose another one"
        }
        ErrorKind::NotFound => "\n  help: check the name and the folder it is looked for in",
        _ => "",
    }
}

impl Error {
    /// 1: our fault; 2: the user's input; 3: a bake refused; 130: interrupted.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input { .. } | Self::Usage { .. } | Self::Io { .. } => 2,
            Self::Refused { .. } => 3,
            Self::Batch { code, .. } => *code,
            Self::Interrupted => 130,
            Self::Internal { .. } => 1,
        }
    }

    /// An input error; `place` names mesh, primitive, accessor and index.
    pub fn input(
        file: &Path,
        place: impl Into<String>,
        what: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self::Input {
            file: file.to_path_buf(),
            place: place.into(),
            what: what.into(),
            help: help.into(),
        }
    }

    /// A wrong argument or recipe key.
    pub fn usage(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Usage {
            what: what.into(),
            help: help.into(),
        }
    }

    /// An operating-system error on a file.
    pub fn io(file: &Path, doing: &'static str, source: std::io::Error) -> Self {
        Self::Io {
            file: file.to_path_buf(),
            doing,
            source,
        }
    }
}
