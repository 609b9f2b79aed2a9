use crate::math::Rgb;
use glam::Vec3;

/// A beam without a table: its extinction is constant.
pub const NO_TABLE: u32 = u32::MAX;

/// `exp(-sigma_t t)`, with `t` possibly infinite: a channel that is not attenuated stays 1.
pub fn transmittance(sigma_t: Rgb, t: f32) -> Rgb {
    let of_channel = |sigma: f32| if sigma == 0.0 { 1.0 } else { (-sigma * t).exp() };
    // A third of the work, in most media.
    if sigma_t.r == sigma_t.g && sigma_t.g == sigma_t.b {
        return Rgb::splat(of_channel(sigma_t.r));
    }
    sigma_t.map(of_channel)
}

/// Optical depths along the beams of varying media, so that a photon costs one look-up.
/// [Collin 2013 §5.3]
#[derive(Debug, Clone, Default)]
pub struct TransmittanceTables {
    tables: Vec<Table>,
    /// Optical depth from the start of the table to each knot, first knot (0) included.
    depths: Vec<Rgb>,
    /// By knot, the table that divides the step behind it further, or [`NO_TABLE`].
    finer: Vec<u32>,
}

/// A step of a table.
#[derive(Debug, Clone, Copy)]
pub struct TableStep {
    /// Optical depth of the step.
    pub depth: Rgb,
    /// A table over this very step, or [`NO_TABLE`]: within a step the depth is a straight line, which is not
    /// good enough where much is absorbed.
    pub finer: u32,
}

#[derive(Debug, Clone, Copy)]
struct Table {
    first: u32,
    steps: u32,
    /// Distance along the beam to the first knot, and between knots.
    start: f32,
    spacing: f32,
}

impl TransmittanceTables {
    /// Adds a table over `[start, start + steps * spacing]`. Outside that range nothing absorbs.
    pub fn push(&mut self, start: f32, spacing: f32, steps: &[TableStep]) -> u32 {
        let index = self.tables.len() as u32;
        self.tables.push(Table {
            first: self.depths.len() as u32,
            steps: steps.len() as u32,
            start,
            spacing,
        });
        let mut depth = Rgb::ZERO;
        self.depths.push(depth);
        for step in steps {
            depth += step.depth;
            self.depths.push(depth);
            self.finer.push(step.finer);
        }
        self.finer.push(NO_TABLE);
        index
    }

    /// Transmittance from the start of the beam to distance `t` along it.
    pub fn transmittance(&self, table: u32, t: f32) -> Rgb {
        self.depth_at(table, t).0.attenuation()
    }

    /// Optical depth from the start of the beam to distance `t` along it, and extinction [1/length] there.
    pub fn depth_at(&self, mut table: u32, t: f32) -> (Rgb, Rgb) {
        let mut depth = Rgb::ZERO;
        loop {
            let Table { first, steps, start, spacing } = self.tables[table as usize];
            let knots = &self.depths[first as usize..=(first + steps) as usize];
            let x = ((t - start) / spacing).clamp(0.0, steps as f32);
            let knot = (x as usize).min(steps as usize - 1);
            let (a, b) = (knots[knot], knots[knot + 1]);
            match self.finer[first as usize + knot] {
                NO_TABLE => return (depth + a + (b - a) * (x - knot as f32), (b - a) / spacing),
                finer => {
                    depth += a;
                    table = finer;
                }
            }
        }
    }

    /// Distance along the beam at which a channel's optical depth is reached, or at which the table ends.
    pub fn distance_to(&self, mut table: u32, channel: usize, depth: f32) -> f32 {
        let mut left = depth;
        loop {
            let Table { first, steps, start, spacing } = self.tables[table as usize];
            let knots = &self.depths[first as usize..=(first + steps) as usize];
            let of = |knot: usize| Vec3::from(knots[knot])[channel];
            let behind = knots.partition_point(|&knot| Vec3::from(knot)[channel] <= left);
            let Some(knot) = behind.checked_sub(1).filter(|_| behind < knots.len()) else {
                return start + steps as f32 * spacing;
            };
            match self.finer[first as usize + knot] {
                NO_TABLE => {
                    let share = ((left - of(knot)) / (of(knot + 1) - of(knot))).clamp(0.0, 1.0);
                    return start + (knot as f32 + share) * spacing;
                }
                finer => {
                    left -= of(knot);
                    table = finer;
                }
            }
        }
    }

    /// Optical depth of a whole table.
    pub fn depth(&self, table: u32) -> Rgb {
        let Table { first, steps, .. } = self.tables[table as usize];
        self.depths[(first + steps) as usize]
    }

    /// Distance along the beam at which the table ends: nothing is behind it.
    pub fn end(&self, table: u32) -> f32 {
        let Table { steps, start, spacing, .. } = self.tables[table as usize];
        start + steps as f32 * spacing
    }

    /// Distance along the beam behind which every channel that is attenuated at all is behind this optical
    /// depth, or at which the table ends.
    pub fn visible_end(&self, table: u32, opaque_depth: f32) -> f32 {
        let Rgb { r, g, b } = self.depth(table);
        let attenuated = [r > 0.0, g > 0.0, b > 0.0];
        if attenuated == [false; 3] {
            return self.end(table);
        }
        let least = |depth: Rgb| {
            let channels = [depth.r, depth.g, depth.b].into_iter().zip(attenuated);
            channels.filter(|(_, counts)| *counts).map(|(d, _)| d).fold(f32::INFINITY, f32::min)
        };
        let (mut table, mut ahead) = (table, Rgb::ZERO);
        loop {
            let Table { first, steps, start, spacing } = self.tables[table as usize];
            let knots = &self.depths[first as usize..=(first + steps) as usize];
            let behind = |knot: usize| least(ahead + knots[knot]);
            let Some(end) = (1..knots.len()).find(|&knot| behind(knot) >= opaque_depth) else {
                return self.end(table);
            };
            match self.finer[first as usize + end - 1] {
                NO_TABLE => {
                    let (a, b) = (behind(end - 1), behind(end));
                    let share = ((opaque_depth - a) / (b - a)).clamp(0.0, 1.0);
                    return start + ((end - 1) as f32 + share) * spacing;
                }
                finer => {
                    ahead += knots[end - 1];
                    table = finer;
                }
            }
        }
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.tables.capacity() * size_of::<Table>()
            + self.depths.capacity() * size_of::<Rgb>()
            + self.finer.capacity() * size_of::<u32>()
    }

    /// Takes over another set; returns what must be added to its table indices.
    pub fn append(&mut self, other: TransmittanceTables) -> u32 {
        let (offset, depth_offset) = (self.tables.len() as u32, self.depths.len() as u32);
        self.tables
            .extend(other.tables.iter().map(|t| Table { first: t.first + depth_offset, ..*t }));
        self.depths.extend(other.depths);
        let moved = |finer| if finer == NO_TABLE { NO_TABLE } else { finer + offset };
        self.finer.extend(other.finer.into_iter().map(moved));
        offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two steps of length 2 from distance 1 on: red reaches depth 3 at the middle of the second, green is
    /// never attenuated, blue never reaches it.
    #[test]
    fn what_is_visible_ends_with_the_last_channel_that_is_attenuated() {
        let mut tables = TransmittanceTables::default();
        let step = |r: f32, b: f32| TableStep { depth: Rgb::new(r, 0.0, b), finer: NO_TABLE };
        let red = tables.push(1.0, 2.0, &[step(2.0, 0.0), step(2.0, 0.0)]);
        let blue = tables.push(1.0, 2.0, &[step(9.0, 1.0), step(9.0, 1.0)]);
        let clear = tables.push(1.0, 2.0, &[step(0.0, 0.0), step(0.0, 0.0)]);
        assert_eq!(tables.visible_end(red, 3.0), 4.0);
        assert_eq!(tables.visible_end(blue, 3.0), 5.0);
        assert_eq!(tables.visible_end(clear, 3.0), 5.0);
        // The depth of 4 lies in the second half of the second step: 3 is reached at 3/4 of it.
        let finer = tables.push(3.0, 1.0, &[step(0.0, 0.0), step(4.0, 0.0)]);
        let coarse = TableStep { finer, ..step(4.0, 0.0) };
        let steep = tables.push(1.0, 2.0, &[step(1.0, 0.0), coarse]);
        assert_eq!(tables.visible_end(steep, 3.0), 4.5);
    }

    /// Nothing over the first half of a step, 8 over the rest of it; then 1 over another step.
    #[test]
    fn finer_tables_shape_the_step_that_they_divide() {
        let step = |depth: f32, finer: u32| TableStep { depth: Rgb::splat(depth), finer };
        let mut other = TransmittanceTables::default();
        other.push(0.0, 1.0, &[step(3.0, NO_TABLE)]);
        let mut tables = TransmittanceTables::default();
        let finer = tables.push(5.0, 1.0, &[step(0.0, NO_TABLE), step(8.0, NO_TABLE)]);
        let root = tables.push(5.0, 2.0, &[step(8.0, finer), step(1.0, NO_TABLE)]);
        let moved = root + other.append(tables);
        let depth = |t: f32| -other.transmittance(moved, t).g.ln();
        for (t, expected) in
            [(4.0, 0.0), (6.0, 0.0), (6.5, 4.0), (7.0, 8.0), (8.0, 8.5), (20.0, 9.0)]
        {
            assert!((depth(t) - expected).abs() < 1e-3, "{} at {t}", depth(t));
        }
        assert_eq!(other.depth(moved), Rgb::splat(9.0));
    }
}
