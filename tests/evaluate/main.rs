//! Levels against their original: figures whose answers are known, and the command.

mod command;
mod figures;
