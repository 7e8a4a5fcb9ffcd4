//! Two folders change places in one step: at every moment each name is one of them, whole.

use std::io::Result;
use std::path::Path;

/// Exchanges two paths; an error where system or file system can't, and then nothing has changed.
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
pub fn exchange(a: &Path, b: &Path) -> Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

/// Exchanges two paths; an error where system or file system can't, and then nothing has changed.
#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
pub fn exchange(_: &Path, _: &Path) -> Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

#[cfg(all(test, any(target_os = "linux", target_vendor = "apple")))]
mod tests {
    use super::*;

    #[test]
    fn folders_change_places_and_a_missing_one_changes_nothing() {
        let home = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|n| home.path().join(n));
        std::fs::create_dir(&a).unwrap();
        std::fs::write(a.join("of a"), b"").unwrap();
        assert!(exchange(&a, &b).is_err());
        assert!(a.join("of a").is_file() && !b.exists());
        std::fs::create_dir(&b).unwrap();
        exchange(&a, &b).unwrap();
        assert!(b.join("of a").is_file() && !a.join("of a").exists());
    }
}
