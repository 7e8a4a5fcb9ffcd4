//! The loader, tried with small files made here, with broken ones, and with real trees.

mod file;
mod geometry;
mod material;
mod mutation;
mod refusal;
mod scene;
mod trees;
