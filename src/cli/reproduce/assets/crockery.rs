//! What stands on tables, turned on the lathe; lengths in metres, feet at the origin.

use super::mesh::Mesh;
use super::solids::{lathe, rounded};

/// How finely curves are divided.
#[derive(Debug, Clone, Copy)]
pub struct Fineness {
    /// Rounds of corner cutting along the profile; every round doubles the pieces.
    pub rounds: u32,
    /// Strips around the axis.
    pub sides: u32,
}

impl Fineness {
    fn turn(self, profile: &[[f32; 2]]) -> Mesh {
        lathe(&rounded(profile, self.rounds), self.sides)
    }

    pub fn plate(self) -> Mesh {
        self.turn(&[
            [0.0, 0.0],
            [0.075, 0.0],
            [0.085, 0.004],
            [0.125, 0.018],
            [0.127, 0.021],
            [0.124, 0.022],
            [0.082, 0.009],
            [0.0, 0.006],
        ])
    }

    pub fn cup(self) -> Mesh {
        self.turn(&[
            [0.0, 0.004],
            [0.024, 0.004],
            [0.026, 0.0],
            [0.029, 0.0],
            [0.030, 0.010],
            [0.042, 0.040],
            [0.045, 0.078],
            [0.044, 0.080],
            [0.042, 0.078],
            [0.038, 0.040],
            [0.026, 0.012],
            [0.0, 0.010],
        ])
    }

    pub fn bowl(self) -> Mesh {
        self.turn(&[
            [0.0, 0.005],
            [0.050, 0.0],
            [0.055, 0.008],
            [0.110, 0.050],
            [0.130, 0.095],
            [0.127, 0.097],
            [0.124, 0.094],
            [0.104, 0.054],
            [0.050, 0.015],
            [0.0, 0.012],
        ])
    }

    pub fn jug(self) -> Mesh {
        self.turn(&[
            [0.0, 0.0],
            [0.055, 0.0],
            [0.075, 0.040],
            [0.085, 0.090],
            [0.070, 0.150],
            [0.045, 0.190],
            [0.048, 0.225],
            [0.055, 0.235],
            [0.050, 0.236],
            [0.042, 0.225],
            [0.040, 0.190],
            [0.065, 0.150],
            [0.079, 0.090],
            [0.068, 0.040],
            [0.0, 0.008],
        ])
    }

    /// A saucepan without its handle.
    pub fn pan(self) -> Mesh {
        self.turn(&[
            [0.0, 0.0],
            [0.095, 0.0],
            [0.105, 0.010],
            [0.105, 0.120],
            [0.110, 0.125],
            [0.102, 0.125],
            [0.100, 0.015],
            [0.0, 0.008],
        ])
    }

    /// A bottle or vase of the given height.
    pub fn bottle(self, height: f32) -> Mesh {
        let shape = [
            [0.0, 0.0],
            [0.040, 0.0],
            [0.043, 0.05],
            [0.042, 0.60],
            [0.016, 0.78],
            [0.015, 0.97],
            [0.019, 1.0],
            [0.0, 1.0],
        ];
        self.turn(&shape.map(|[radius, share]| [radius, share * height]))
    }

    /// A ball that stands on the origin.
    pub fn ball(self, radius: f32) -> Mesh {
        let arc = |k: u32| {
            let (sin, cos) =
                (std::f32::consts::PI * k as f32 / (4 << self.rounds) as f32).sin_cos();
            [radius * sin, radius * (1.0 - cos)]
        };
        lathe(&(0..=4 << self.rounds).map(arc).collect::<Vec<_>>(), self.sides)
    }

    /// A turned leg of the given height and largest radius.
    pub fn leg(self, height: f32, radius: f32) -> Mesh {
        let shape = [
            [0.0, 0.0],
            [0.55, 0.0],
            [0.75, 0.04],
            [0.50, 0.10],
            [0.80, 0.45],
            [0.95, 0.70],
            [0.55, 0.76],
            [1.0, 0.82],
            [1.0, 1.0],
            [0.0, 1.0],
        ];
        self.turn(&shape.map(|[r, h]| [r * radius, h * height]))
    }
}
