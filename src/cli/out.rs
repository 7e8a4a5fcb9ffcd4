//! What goes to the terminal. Readers may go away (`| head`): that is no fault, and no panic.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::path::Path;

use crate::error::{Error, Result};

/// Writes to standard output. A closed pipe is no fault: the reader has seen enough.
///
/// # Errors
/// [`Error::Io`] where it can't be written for another reason.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::io(Path::new("standard output"), "write", e))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error, where somebody reads it.
pub fn say(line: Arguments) {
    // Where even errors can't be written, there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "{line}");
}
