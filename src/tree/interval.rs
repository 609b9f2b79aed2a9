/// Parameters of a photon beam, both ends included.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Interval {
    pub start: f32,
    pub end: f32,
}

impl Interval {
    #[inline]
    pub fn is_empty(self) -> bool {
        self.start > self.end
    }

    /// The part where `height + t · rise` is at most `limit`, up to roundings.
    ///
    /// Where an overflow makes NaN, `min` and `max` keep the old end.
    #[inline]
    pub fn clip(self, height: f32, rise: f32, limit: f32) -> Self {
        let t = (limit - height) / rise;
        if rise > 0.0 {
            Interval { end: self.end.min(t), ..self }
        } else if rise < 0.0 {
            Interval { start: self.start.max(t), ..self }
        } else if height > limit {
            Interval { start: f32::INFINITY, end: f32::NEG_INFINITY }
        } else {
            self
        }
    }
}
