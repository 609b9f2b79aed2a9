use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// A linear RGB triple: radiance, flux, a coefficient or a dimensionless weight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Rgb {
    pub r: f32,
    pub g: f32,
    pub b: f32,
}

impl Rgb {
    pub const ZERO: Rgb = Rgb::splat(0.0);
    pub const ONE: Rgb = Rgb::splat(1.0);

    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Rgb { r, g, b }
    }

    pub const fn splat(value: f32) -> Self {
        Rgb::new(value, value, value)
    }

    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Rgb::new(f(self.r), f(self.g), f(self.b))
    }

    /// `exp(-tau)`, channel by channel: the transmittance of an optical depth.
    pub fn attenuation(self) -> Self {
        self.map(|tau| (-tau).exp())
    }

    /// 0 in place of what is below it. What is no number stays so.
    pub fn not_negative(self) -> Self {
        self.map(|value| if value < 0.0 { 0.0 } else { value })
    }

    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    pub fn min_component(self) -> f32 {
        self.r.min(self.g).min(self.b)
    }

    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) / 3.0
    }

    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    pub fn is_zero(self) -> bool {
        self == Rgb::ZERO
    }
}

impl From<glam::Vec3> for Rgb {
    fn from(v: glam::Vec3) -> Self {
        Rgb::new(v.x, v.y, v.z)
    }
}

impl From<Rgb> for glam::Vec3 {
    fn from(c: Rgb) -> Self {
        glam::Vec3::new(c.r, c.g, c.b)
    }
}

impl Add for Rgb {
    type Output = Rgb;
    fn add(self, o: Rgb) -> Rgb {
        Rgb::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl AddAssign for Rgb {
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl Sub for Rgb {
    type Output = Rgb;
    fn sub(self, o: Rgb) -> Rgb {
        Rgb::new(self.r - o.r, self.g - o.g, self.b - o.b)
    }
}

impl Mul for Rgb {
    type Output = Rgb;
    fn mul(self, o: Rgb) -> Rgb {
        Rgb::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl MulAssign for Rgb {
    fn mul_assign(&mut self, o: Rgb) {
        *self = *self * o;
    }
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    fn mul(self, s: f32) -> Rgb {
        Rgb::new(self.r * s, self.g * s, self.b * s)
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    fn div(self, s: f32) -> Rgb {
        Rgb::new(self.r / s, self.g / s, self.b / s)
    }
}
