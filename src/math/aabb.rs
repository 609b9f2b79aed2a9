use glam::Vec3;

/// An axis-aligned box, closed on all sides. Empty where `min > max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Aabb {
    pub const EMPTY: Aabb = Aabb { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };
    pub const UNBOUNDED: Aabb = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    pub fn grow(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Length of the diagonal; 0 for an empty box.
    pub fn diagonal(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            (self.max - self.min).length()
        }
    }

    /// The part `[t0, t1]` of the ray `origin + t direction`, `t >= 0`, inside the box.
    pub fn clip(&self, origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
        let (mut t0, mut t1) = (0.0f32, f32::INFINITY);
        for axis in 0..3 {
            let (o, d) = (origin[axis], direction[axis]);
            if d == 0.0 {
                if o < self.min[axis] || o > self.max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.min[axis] - o) / d, (self.max[axis] - o) / d);
            t0 = t0.max(a.min(b));
            t1 = t1.min(a.max(b));
        }
        (t0 < t1).then_some((t0, t1))
    }

    /// The smallest box that holds both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// What both boxes share; empty where they do not meet.
    pub fn intersection(&self, other: &Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Side lengths; negative on an axis where the box is empty.
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Half-open membership, `min <= p < max` on every axis, so that boxes which tile space hold each point once.
    #[inline]
    pub fn owns(&self, p: Vec3) -> bool {
        p.cmpge(self.min).all() && p.cmplt(self.max).all()
    }

    /// Whether `p` is at most `reach` from the closed box on every single axis (Chebyshev distance).
    #[inline]
    pub fn is_within_reach(&self, p: Vec3, reach: f32) -> bool {
        let gap = (self.min - p).max(p - self.max);
        gap.max_element() <= reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ownership_is_half_open() {
        let cell = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        assert!(cell.owns(Vec3::ZERO));
        assert!(!cell.owns(Vec3::new(0.5, 0.5, 1.0)));
        assert!(Aabb::UNBOUNDED.owns(Vec3::splat(-1e30)));
    }

    #[test]
    fn reach_is_closed_and_per_axis() {
        let cell = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        assert!(cell.is_within_reach(Vec3::new(1.5, -0.5, 0.5), 0.5));
        assert!(!cell.is_within_reach(Vec3::new(1.75, 0.5, 0.5), 0.5));
        assert!(!Aabb::EMPTY.is_within_reach(Vec3::ZERO, f32::MAX));
    }
}
