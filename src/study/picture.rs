//! Sheets of pictures, and PNG files.

use std::path::Path;

use super::frame::Frame;
use crate::error::{Error, Result};

/// Pictures of one size in rows, on white.
pub struct Sheet {
    cell: [usize; 2],
    columns: usize,
    rows: usize,
    rgba: Vec<u8>,
}

impl Sheet {
    /// An empty sheet of `columns` x `rows` cells of so many pixels.
    pub fn new(columns: usize, rows: usize, width: u32, height: u32) -> Self {
        let cell = [width as usize, height as usize];
        Self {
            cell,
            columns,
            rows,
            rgba: vec![255; columns * rows * cell[0] * cell[1] * 4],
        }
    }

    /// Frames of one size under each other.
    pub fn column(frames: &[Frame]) -> Self {
        let pictures: Vec<_> = frames.iter().map(Frame::picture).collect();
        let (width, height) = pictures.first().map_or((1, 1), |p| (p.0, p.1));
        let mut sheet = Self::new(1, frames.len().max(1), width, height);
        for (row, (_, _, rgba)) in pictures.iter().enumerate() {
            sheet.put(0, row, rgba);
        }
        sheet
    }

    /// Puts a picture of RGBA bytes into a cell.
    pub fn put(&mut self, column: usize, row: usize, rgba: &[u8]) {
        let [width, height] = self.cell;
        for (y, line) in rgba.chunks_exact(width * 4).enumerate().take(height) {
            let at = ((row * height + y) * self.columns + column) * width * 4;
            self.rgba[at..at + width * 4].copy_from_slice(line);
        }
    }

    /// Writes the sheet as PNG.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, file: &Path) -> Result<()> {
        let (width, height) = (self.columns * self.cell[0], self.rows * self.cell[1]);
        image::save_buffer(
            file,
            &self.rgba,
            width as u32,
            height as u32,
            image::ColorType::Rgba8,
        )
        .map_err(|e| Error::io(file, "write", std::io::Error::other(e)))
    }
}
