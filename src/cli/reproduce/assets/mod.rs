//! What the scenes of [`super::scenes`] consist of besides their XML: [`mesh`]es put together of [`solids`],
//! [`crockery`] and [`furniture`], density [`grid`]s made of [`noise`], and the [`dragon`], which a [`package`] holds.

pub mod breakfast_hall;
mod crockery;
pub mod dragon;
pub mod dragon_smokes;
mod furniture;
mod grid;
pub mod kitchen;
mod mesh;
mod noise;
mod package;
mod solids;

use grid::Grid;
use mesh::Mesh;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A file that a scene reads.
pub enum Asset {
    Mesh(Mesh),
    Grid(Grid),
}

impl Asset {
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        match self {
            Asset::Mesh(mesh) => mesh.write_ply(&mut file)?,
            Asset::Grid(grid) => grid.write_vol(&mut file)?,
        }
        file.flush()
    }
}
