use super::build::offsets;
use super::{ApexGrid, LANES, WIDER};

impl ApexGrid {
    /// Checks every invariant that a query relies on and describes the first violation.
    pub fn validate(&self) -> Result<(), String> {
        if self.slopes.iter().any(|slopes| slopes.len() != self.beams.len() + LANES) {
            return Err("slopes are not as many as beams and lanes".into());
        }
        if self.starts.len() != self.cells[0] * self.cells[1] + 1
            || self.starts.first() != Some(&0)
            || self.starts.last().map(|&end| end as usize) != Some(self.beams.len())
        {
            return Err(format!("{} starts for {:?} cells", self.starts.len(), self.cells));
        }
        for cell in 0..self.starts.len() - 1 {
            if self.starts[cell] > self.starts[cell + 1] {
                return Err(format!("cell {cell} ends before it starts"));
            }
            for place in self.starts[cell] as usize..self.starts[cell + 1] as usize {
                self.check(cell, place)?;
            }
        }
        Ok(())
    }

    fn check(&self, cell: usize, place: usize) -> Result<(), String> {
        let segment = &self.beams[place].segment;
        let d = self.to_frame.as_dmat3() * segment.direction.as_dvec3();
        let slope = [(d.x / d.z) as f32, (d.y / d.z) as f32];
        let (column, row) = (cell % self.cells[0], cell / self.cells[0]);
        let near = |axis: usize, at: usize| {
            let wider = WIDER * (1.0 + slope[axis].abs());
            (self.column(axis, slope[axis] - wider)..=self.column(axis, slope[axis] + wider))
                .contains(&at)
        };
        let (beside, behind) = offsets(segment, self.apex.as_dvec3());
        let stored = [0, 1].map(|axis| self.slopes[axis][place]);
        if stored != slope {
            return Err(format!("a beam of slope {slope:?} is listed with {stored:?}"));
        }
        if !(near(0, column) && near(1, row)) {
            return Err(format!("a beam of slope {slope:?} lies in cell {column}, {row}"));
        }
        if beside.max(behind) > f64::from(self.slack) {
            return Err(format!(
                "a line passes {beside} beside the apex, and starts {behind} behind"
            ));
        }
        Ok(())
    }
}
