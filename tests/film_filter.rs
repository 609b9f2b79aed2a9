//! Pictures come through the film's own reconstruction filter, in all pixels of a crop window.
//!
//! A lit rectangle before nothing is 1 within it and 0 without, so a pixel shows which share of its filter lies on the rectangle:
//! along an axis the integral of the filter over the lit stretch, divided by that over all places where rays start. Rays start in
//! the crop window, and around it as far as the filter reaches if the film has `sample_border`.

use std::path::Path;
use std::process::Command;
use vpt::picture::LayeredPicture;

#[path = "support/llvm.rs"]
mod llvm;

/// Film coordinates: the crop window, and the lit stretch along both axes.
const CROP_OFFSET: [u32; 2] = [5, 3];
const CROP_SIZE: [u32; 2] = [30, 28];
const LIT: [[f64; 2]; 2] = [[6.2, 22.3], [4.4, 20.6]];
/// Rows of the crop window whose filter, of any kind here, ends within the lit rows; and columns.
const INSIDE: [std::ops::Range<usize>; 2] = [5..13, 5..13];

/// The film's width spans -1 to 1 of the world.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt"/>
    <sensor type="orthographic">
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"/>
        <film type="hdrfilm">
            <integer name="width" value="48"/><integer name="height" value="36"/>
            <integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
            <integer name="crop_width" value="30"/><integer name="crop_height" value="28"/>
            <boolean name="sample_border" value="$border"/>
            <string name="component_format" value="float32"/>
            <string name="pixel_format" value="rgba"/>
            <rfilter type="$filter"/>
        </film>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><scale x="$scale_x" y="$scale_y"/><translate x="$x" y="$y"/></transform>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter>
    </shape>
</scene>"#;

/// The radius, and the function within it of Mitsuba's documentation with its default parameters.
struct Filter {
    name: &'static str,
    radius: f64,
    value: fn(f64) -> f64,
}

const FILTERS: [Filter; 6] = [
    Filter { name: "box", radius: 0.5, value: |_| 1.0 },
    Filter { name: "tent", radius: 1.0, value: |x| 1.0 - x },
    Filter {
        name: "gaussian",
        radius: 2.0,
        value: |x| (-2.0 * x * x).exp() - (-2.0f64 * 4.0).exp(),
    },
    Filter { name: "mitchell", radius: 2.0, value: |x| cubic(x, 1.0 / 3.0, 1.0 / 3.0) },
    Filter { name: "catmullrom", radius: 2.0, value: |x| cubic(x, 0.0, 0.5) },
    Filter { name: "lanczos", radius: 3.0, value: |x| sinc(x) * sinc(x / 3.0) },
];

// [Mitchell 1988]
fn cubic(x: f64, b: f64, c: f64) -> f64 {
    let sum = if x < 1.0 {
        (12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
            + (-18.0 + 12.0 * b + 6.0 * c) * x.powi(2)
            + (6.0 - 2.0 * b)
    } else {
        (-b - 6.0 * c) * x.powi(3)
            + (6.0 * b + 30.0 * c) * x.powi(2)
            + (-12.0 * b - 48.0 * c) * x
            + (8.0 * b + 24.0 * c)
    };
    sum / 6.0
}

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x < 1e-6 {
        1.0
    } else {
        x.sin() / x
    }
}

impl Filter {
    /// At this distance from a pixel's middle. Scalar variants of Mitsuba know the values at the beginnings of 31 steps.
    fn at(&self, distance: f64, is_scalar: bool) -> f64 {
        let steps_per_pixel = 31.0 / self.radius;
        let in_steps = (distance * steps_per_pixel).floor() / steps_per_pixel;
        (self.value)(if is_scalar { in_steps } else { distance })
    }

    /// Around `middle`, over the places between `low` and `high`, by the midpoint rule.
    fn integral(&self, middle: f64, [low, high]: [f64; 2], power: i32, is_scalar: bool) -> f64 {
        const CELLS: usize = 4000;
        let (low, high) = (low.max(middle - self.radius), high.min(middle + self.radius));
        let width = (high - low).max(0.0) / CELLS as f64;
        let at = |cell: usize| (low + (cell as f64 + 0.5) * width - middle).abs();
        (0..CELLS).map(|cell| self.at(at(cell), is_scalar).powi(power) * width).sum()
    }

    /// What the pixels along an axis show where the other axis is lit all over.
    fn profile(&self, axis: usize, has_border: bool, is_scalar: bool) -> Vec<f64> {
        let (offset, size) = (f64::from(CROP_OFFSET[axis]), f64::from(CROP_SIZE[axis]));
        let border = if has_border { (self.radius - 0.5).ceil() } else { 0.0 };
        let rays = [offset - border, offset + size + border];
        let share = |pixel: u32| {
            let middle = offset + f64::from(pixel) + 0.5;
            self.integral(middle, LIT[axis], 1, is_scalar)
                / self.integral(middle, rays, 1, is_scalar)
        };
        (0..CROP_SIZE[axis]).map(share).collect()
    }

    /// Samples that a pixel takes of each pass, as many as count alike: `(sum of weights)² / sum of squared weights`, for a ray per pixel.
    fn samples(&self) -> f64 {
        let everywhere = [-self.radius, self.radius];
        let [sum, squares] = [1, 2].map(|power| self.integral(0.0, everywhere, power, false));
        (sum.powi(2) / squares).powi(2)
    }
}

fn render(
    folder: &Path,
    filter: &Filter,
    has_border: bool,
    passes: u32,
    variant: &str,
) -> LayeredPicture {
    let to_world = |axis: usize, film: f64| match axis {
        0 => film / 24.0 - 1.0,
        _ => 0.75 - film / 24.0,
    };
    let [[left, right], [bottom, top]] =
        [0, 1].map(|axis| LIT[axis].map(|film| to_world(axis, film)));
    let picture = folder.join("picture.exr");
    let output = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .arg("render")
        .arg(folder.join("scene.xml"))
        .args(["-q", "--set", "photons=16", "--set", "estimate_error=false"])
        .args(["--set", &format!("emission_rays={has_border}")])
        .args(["--passes", &passes.to_string(), "-D", &format!("filter={}", filter.name)])
        .args(["-D", &format!("border={has_border}")])
        .args(["-D", &format!("scale_x={}", 0.5 * (right - left))])
        .args(["-D", &format!("scale_y={}", 0.5 * (bottom - top))])
        .args(["-D", &format!("x={}", 0.5 * (left + right))])
        .args(["-D", &format!("y={}", 0.5 * (bottom + top))])
        .args(["--variant", variant])
        .arg("-o")
        .arg(&picture)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    LayeredPicture::read(&picture).unwrap().0
}

/// Means along the lit rows are compared column by column, and the other way round. A sample is 0 or 1, so its variance is a
/// quarter at most, and less as rays are jittered within their pixels: five standard errors are never met by chance.
fn assert_profiles(filter: &Filter, has_border: bool, passes: u32, variant: &str) {
    let is_scalar = variant.starts_with("scalar");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
    let picture = render(folder.path(), filter, has_border, passes, variant);
    let width = CROP_SIZE[0] as usize;
    for channel in ["R", "A"] {
        let values = picture.channel(channel).unwrap();
        for axis in 0..2 {
            let lines = INSIDE[1 - axis].clone();
            let profile = filter.profile(axis, has_border, is_scalar);
            let bound = 2.5 / (f64::from(passes) * lines.len() as f64 * filter.samples()).sqrt();
            for (pixel, expected) in profile.into_iter().enumerate() {
                let value = |line: usize| {
                    let [x, y] = if axis == 0 { [pixel, line] } else { [line, pixel] };
                    f64::from(values[y * width + x])
                };
                let mean = lines.clone().map(value).sum::<f64>() / lines.len() as f64;
                assert!(
                    (mean - expected).abs() < bound,
                    "{}, border {has_border}, {channel} along axis {axis}, pixel {pixel}: {mean} instead of {expected} +- {bound}",
                    filter.name
                );
            }
        }
    }
}

#[test]
fn scalar_variants_show_every_filter() {
    for filter in &FILTERS {
        for has_border in [false, true] {
            assert_profiles(filter, has_border, 2000, "scalar_rgb");
        }
    }
}

#[test]
fn kernels_show_filters_too() {
    if llvm::llvm_or_skip("filters in kernels").is_none() {
        return;
    }
    for filter in
        FILTERS.iter().filter(|filter| ["box", "gaussian", "lanczos"].contains(&filter.name))
    {
        for has_border in [false, true] {
            assert_profiles(filter, has_border, 400, "llvm_ad_rgb");
        }
    }
}
