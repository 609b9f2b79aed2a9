use glam::{Vec3, Vec4};
use std::ops::{Add, Mul, Sub};

/// Four vectors, coordinate by coordinate. Every operation rounds as that of [`Vec3`] does, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Vec3x4 {
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
}

impl Vec3x4 {
    /// The same vector in every lane.
    #[inline]
    pub fn splat(v: Vec3) -> Self {
        let [x, y, z] = v.to_array().map(Vec4::splat);
        Vec3x4 { x, y, z }
    }

    #[inline]
    pub fn dot(self, other: Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline]
    pub fn cross(self, other: Self) -> Self {
        Vec3x4 {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline]
    pub fn length_squared(self) -> Vec4 {
        self.dot(self)
    }
}

impl Add for Vec3x4 {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Vec3x4 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for Vec3x4 {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Vec3x4 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul<Vec3x4> for Vec4 {
    type Output = Vec3x4;

    #[inline]
    fn mul(self, v: Vec3x4) -> Vec3x4 {
        Vec3x4 { x: self * v.x, y: self * v.y, z: self * v.z }
    }
}
