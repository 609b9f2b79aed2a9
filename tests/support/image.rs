//! Images as the tests need them: RGB in `f32`, read from and written to EXR, shown as PNG.

use std::path::Path;

use exr::prelude::{f16, read_first_flat_layer_from_file, write_rgb_file, FlatSamples};

#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    pub fn from_fn(
        width: usize,
        height: usize,
        mut pixel: impl FnMut(usize, usize) -> [f32; 3],
    ) -> Self {
        let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        Image { width, height, pixels }
    }

    /// The channels `R`, `G`, `B` of an EXR file, or `Y` in place of each, with `prefix` before the name. All values
    /// must be finite.
    pub fn read_exr(path: &Path, prefix: &str) -> Result<Self, String> {
        let file = read_first_flat_layer_from_file(path)
            .map_err(|e| format!("{}: {e}", path.display()))?;
        let layer = file.layer_data;
        let channel = |colour: &str| {
            let name = format!("{prefix}{colour}");
            let named =
                |name: &str| layer.channel_data.list.iter().find(|c| c.name.to_string() == name);
            let found = named(&name).or_else(|| named(&format!("{prefix}Y")));
            let samples =
                &found.ok_or(format!("{}: no channel {name}", path.display()))?.sample_data;
            Ok::<Vec<f32>, String>(match samples {
                FlatSamples::F16(values) => values.iter().map(|v: &f16| v.to_f32()).collect(),
                FlatSamples::F32(values) => values.clone(),
                FlatSamples::U32(values) => values.iter().map(|&v| v as f32).collect(),
            })
        };
        let (red, green, blue) = (channel("R")?, channel("G")?, channel("B")?);
        let image = Image::from_fn(layer.size.width(), layer.size.height(), |x, y| {
            let i = y * layer.size.width() + x;
            [red[i], green[i], blue[i]]
        });
        match image.pixels.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            Some(i) => Err(format!("{}: pixel {} is {:?}", path.display(), i, image.pixels[i])),
            None => Ok(image),
        }
    }

    pub fn write_exr(&self, path: &Path) -> Result<(), String> {
        write_rgb_file(path, self.width, self.height, |x, y| {
            let [r, g, b] = self.pixels[y * self.width + x];
            (r, g, b)
        })
        .map_err(|e| format!("{}: {e}", path.display()))
    }

    /// The image as 8-bit sRGB, with `white` as the brightest value that is told apart.
    pub fn write_png(&self, path: &Path, white: f32) -> Result<(), String> {
        let bytes: Vec<u8> =
            self.pixels.iter().flatten().map(|&v| vpt::math::srgb::byte(v / white)).collect();
        let picture = ::image::RgbImage::from_raw(self.width as u32, self.height as u32, bytes)
            .ok_or_else(|| format!("{}: an impossible size", path.display()))?;
        picture.save(path).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// The mean colours of blocks of `size` by `size` pixels, row by row. `size` must divide both
    /// sides.
    pub fn block_means(&self, size: usize) -> Vec<[f64; 3]> {
        assert!(self.width % size == 0 && self.height % size == 0);
        let columns = self.width / size;
        let mut sums = vec![[0.0; 3]; columns * (self.height / size)];
        for (i, pixel) in self.pixels.iter().enumerate() {
            let block = i / self.width / size * columns + i % self.width / size;
            for (sum, &value) in sums[block].iter_mut().zip(pixel) {
                *sum += f64::from(value);
            }
        }
        let area = (size * size) as f64;
        sums.into_iter().map(|s| s.map(|v| v / area)).collect()
    }

    pub fn mean(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| {
            self.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / self.pixels.len() as f64
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixel (x, y) of a 4 x 2 image is x + 10 y. The left block of 2 x 2 holds 0, 1, 10, 11: mean
    /// 5.5; the right one 2, 3, 12, 13: mean 7.5; the image's mean is that of both, 6.5.
    #[test]
    fn block_means_of_a_ramp() {
        let ramp = Image::from_fn(4, 2, |x, y| [(x + 10 * y) as f32; 3]);
        assert_eq!(ramp.block_means(2), vec![[5.5; 3], [7.5; 3]]);
        assert_eq!(ramp.mean(), [6.5; 3]);
    }

    /// Rows, columns and channels all differ, so that any mix-up of them shows.
    #[test]
    fn exr_files_keep_every_value() {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exr_files_keep_every_value.exr");
        let image = Image::from_fn(3, 2, |x, y| [x as f32, y as f32 + 0.1, -1e-7]);
        image.write_exr(&path).unwrap();
        assert_eq!(Image::read_exr(&path, "").unwrap(), image);
    }

    #[test]
    fn a_file_with_nan_is_refused() {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("a_file_with_nan_is_refused.exr");
        Image::from_fn(2, 2, |x, _| [0.0, f32::NAN.powi(x as i32), 0.0]).write_exr(&path).unwrap();
        let error = Image::read_exr(&path, "").unwrap_err();
        assert!(error.contains("pixel 1 is [0.0, NaN, 0.0]"), "{error}");
    }
}
