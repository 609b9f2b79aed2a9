use crate::math::Rgb;

/// A beam without a table: its extinction is constant.
pub const NO_TABLE: u32 = u32::MAX;

/// `exp(-sigma_t t)`, with `t` possibly infinite: a channel that is not attenuated stays 1.
pub fn transmittance(sigma_t: Rgb, t: f32) -> Rgb {
    sigma_t.map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * t).exp() })
}

/// Optical depths along the beams of varying media, so that a photon costs one look-up.
/// [Collin 2013 §5.3]
#[derive(Debug, Clone, Default)]
pub struct TransmittanceTables {
    tables: Vec<Table>,
    /// Optical depth from the start of the table to each knot, first knot (0) included.
    depths: Vec<Rgb>,
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
    /// Adds a table over `[start, start + steps * spacing]` from the optical depth of each step.
    /// Outside that range nothing absorbs.
    pub fn push(&mut self, start: f32, spacing: f32, depth_of_steps: &[Rgb]) -> u32 {
        let index = self.tables.len() as u32;
        self.tables.push(Table {
            first: self.depths.len() as u32,
            steps: depth_of_steps.len() as u32,
            start,
            spacing,
        });
        let mut depth = Rgb::ZERO;
        self.depths.push(depth);
        for &step in depth_of_steps {
            depth += step;
            self.depths.push(depth);
        }
        index
    }

    /// Transmittance from the start of the beam to distance `t` along it.
    pub fn transmittance(&self, table: u32, t: f32) -> Rgb {
        let Table { first, steps, start, spacing } = self.tables[table as usize];
        let knots = &self.depths[first as usize..=(first + steps) as usize];
        let x = ((t - start) / spacing).clamp(0.0, steps as f32);
        let knot = (x as usize).min(steps as usize - 1);
        let (a, b) = (knots[knot], knots[knot + 1]);
        (a + (b - a) * (x - knot as f32)).attenuation()
    }

    /// Distance along the beam at which the table ends: nothing is behind it.
    pub fn end(&self, table: u32) -> f32 {
        let Table { steps, start, spacing, .. } = self.tables[table as usize];
        start + steps as f32 * spacing
    }

    /// Distance along the beam behind which every channel that is attenuated at all is behind this optical
    /// depth, or at which the table ends.
    pub fn visible_end(&self, table: u32, opaque_depth: f32) -> f32 {
        let Table { first, steps, start, spacing } = self.tables[table as usize];
        let knots = &self.depths[first as usize..=(first + steps) as usize];
        let Rgb { r, g, b } = knots[steps as usize];
        let attenuates = [r > 0.0, g > 0.0, b > 0.0];
        let least = |depth: &Rgb| {
            let channels = [depth.r, depth.g, depth.b].into_iter().zip(attenuates);
            channels.filter(|(_, counts)| *counts).map(|(d, _)| d).fold(f32::INFINITY, f32::min)
        };
        match knots.iter().position(|depth| least(depth) >= opaque_depth) {
            Some(knot) if knot > 0 => {
                let (before, behind) = (least(&knots[knot - 1]), least(&knots[knot]));
                let share = ((opaque_depth - before) / (behind - before)).clamp(0.0, 1.0);
                start + ((knot - 1) as f32 + share) * spacing
            }
            Some(_) | None => self.end(table),
        }
    }

    /// Takes over another set; returns what must be added to its table indices.
    pub fn append(&mut self, other: TransmittanceTables) -> u32 {
        let (offset, depth_offset) = (self.tables.len() as u32, self.depths.len() as u32);
        self.tables
            .extend(other.tables.iter().map(|t| Table { first: t.first + depth_offset, ..*t }));
        self.depths.extend(other.depths);
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
        let red = tables.push(1.0, 2.0, &[Rgb::new(2.0, 0.0, 0.0), Rgb::new(2.0, 0.0, 0.0)]);
        let blue = tables.push(1.0, 2.0, &[Rgb::new(9.0, 0.0, 1.0), Rgb::new(9.0, 0.0, 1.0)]);
        let clear = tables.push(1.0, 2.0, &[Rgb::ZERO, Rgb::ZERO]);
        assert_eq!(tables.visible_end(red, 3.0), 4.0);
        assert_eq!(tables.visible_end(blue, 3.0), 5.0);
        assert_eq!(tables.visible_end(clear, 3.0), 5.0);
    }
}
