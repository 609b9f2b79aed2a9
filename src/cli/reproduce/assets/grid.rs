//! Densities on a grid, and how Mitsuba reads them.

use std::io::{self, Write};

/// Densities at the cells of the unit cube.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Along x, y and z.
    pub cells: [u32; 3],
    /// x runs fastest.
    pub values: Vec<f32>,
}

impl Grid {
    /// The density at the centre of every cell, in [0, 1]^3.
    pub fn from_fn(cells: [u32; 3], density: impl Fn([f32; 3]) -> f32) -> Self {
        let centre = |index: [u32; 3]| [0, 1, 2].map(|k| (index[k] as f32 + 0.5) / cells[k] as f32);
        let mut values = Vec::new();
        for z in 0..cells[2] {
            for y in 0..cells[1] {
                values.extend((0..cells[0]).map(|x| density(centre([x, y, z]))));
            }
        }
        Grid { cells, values }
    }

    /// Mitsuba's `.vol`, version 3, with one channel.
    pub fn write_vol(&self, to: &mut impl Write) -> io::Result<()> {
        to.write_all(b"VOL\x03")?;
        let (kind_is_f32, channels) = (1i32, 1i32);
        let [x, y, z] = self.cells.map(|count| count as i32);
        for number in [kind_is_f32, x, y, z, channels] {
            to.write_all(&number.to_le_bytes())?;
        }
        for bound in [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0] {
            to.write_all(&bound.to_le_bytes())?;
        }
        for value in &self.values {
            to.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn x_runs_fastest_and_the_file_is_as_long_as_its_header_says() {
        let grid = Grid::from_fn([4, 2, 3], |[x, y, z]| x + 10.0 * y + 100.0 * z);
        assert_eq!(grid.values[1] - grid.values[0], 0.25);
        assert_eq!(grid.values[4] - grid.values[0], 5.0);
        let mut bytes = Vec::new();
        grid.write_vol(&mut bytes).unwrap();
        assert_eq!(bytes.len(), 4 + 5 * 4 + 6 * 4 + 24 * 4);
        assert_eq!(bytes[8..12], 4i32.to_le_bytes());
    }
}
