//! Whole renders by the binary: the same bits whatever the threads, and numbers that are not numbers.

use std::fs;
use std::path::Path;
use std::process::Command;
use vpt::picture::LayeredPicture;

#[allow(dead_code)]
#[path = "support/image.rs"]
mod image;

use image::Image;

/// A closed room of fog whose albedo comes from a grid of 2 x 2 x 2 voxels.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt"><integer name="max_depth" value="6"/></integrator>
    <medium type="homogeneous" id="fog">
        <float name="sigma_t" value="0.8"/>
        <volume name="albedo" type="gridvolume">
            <string name="filename" value="albedo.vol"/>
            <string name="filter_type" value="nearest"/>
            <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform>
        </volume>
    </medium>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, -0.9" target="0, 0, 0" up="0, 1, 0"/></transform>
        <ref name="medium" id="fog"/>
        <sampler type="independent"><integer name="sample_count" value="3"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="24"/><integer name="height" value="16"/>
            <string name="component_format" value="float32"/>
            <string name="pixel_format" value="rgb"/>
        </film>
    </sensor>
    <shape type="cube">
        <boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"/>
    </shape>
    <emitter type="point">
        <point name="position" x="0.2" y="0.7" z="0.1"/>
        <ref id="fog"/>
        <rgb name="intensity" value="3, 2, 1"/>
    </emitter>
</scene>"#;

/// Mitsuba's grid format: "VOL", version 3, type 1 (f32), size, channels, bounds, values.
fn write_scene(folder: &Path, albedo: [f32; 8]) {
    let mut bytes = b"VOL\x03".to_vec();
    for integer in [1i32, 2, 2, 2, 1] {
        bytes.extend(integer.to_le_bytes());
    }
    for number in [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0].into_iter().chain(albedo) {
        bytes.extend(number.to_le_bytes());
    }
    fs::write(folder.join("albedo.vol"), bytes).unwrap();
    fs::write(folder.join("scene.xml"), SCENE).unwrap();
}

/// Renders the folder's scene and returns what it printed on stderr.
fn render(folder: &Path, picture: &str, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .arg("render")
        .arg(folder.join("scene.xml"))
        .args(["--set", "photons=6000", "-q", "--stats"])
        .arg(folder.join("stats.json"))
        .arg("-o")
        .arg(folder.join(picture))
        .args(arguments)
        .output()
        .unwrap();
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{messages}");
    messages
}

/// Of all channels; what else the file holds, the command for one, may differ.
fn bits_of(picture: &Path) -> Vec<(String, Vec<u32>)> {
    let (picture, _) = LayeredPicture::read(picture).unwrap();
    let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect();
    picture.channels.into_iter().map(|channel| (channel.name, bits(channel.values))).collect()
}

#[test]
fn the_same_seed_gives_the_same_bits_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), [0.9; 8]);
    let bits = |variant: &str, threads: &str, seed: &str| {
        let arguments = ["--variant", variant, "--threads", threads, "--seed", seed];
        render(folder.path(), "picture.exr", &arguments);
        let stats = fs::read(folder.path().join("stats.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
        assert_eq!(stats["threads"].to_string(), threads);
        bits_of(&folder.path().join("picture.exr"))
    };
    for variant in ["scalar_rgb", "scalar_spectral"] {
        let one = bits(variant, "1", "5");
        assert!(one == bits(variant, "2", "5"), "{variant}: 2 threads differ from 1");
        assert!(one == bits(variant, "8", "5"), "{variant}: 8 threads differ from 1");
        assert!(one != bits(variant, "1", "6"), "{variant}: the seed changes nothing");
        assert_eq!(one.len(), 3);
    }
}

/// One voxel's albedo is not a number: photons that collide there are dropped, counted and reported,
/// and the picture is that of the others.
/// Mitsuba orders meshes, and so the lamps on them, by addresses; which lamp a number chooses must not follow.
#[test]
fn the_same_seed_gives_the_same_bits_in_every_process() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), [0.9; 8]);
    let lamps: String = (1..5)
        .map(|lamp| {
            format!(
                r#"<shape type="rectangle">
                    <transform name="to_world">
                        <scale value="0.1"/><translate x="{}" y="0.2" z="0.9"/>
                    </transform>
                    <emitter type="area"><rgb name="radiance" value="{lamp}, 2, 1"/></emitter>
                    <ref name="exterior" id="fog"/>
                </shape>"#,
                0.3 * f64::from(lamp) - 0.75
            )
        })
        .collect();
    let scene = SCENE.replace("</scene>", &format!("{lamps}</scene>"));
    fs::write(folder.path().join("scene.xml"), scene).unwrap();
    let bits = || {
        render(folder.path(), "picture.exr", &["--passes", "1", "--variant", "scalar_rgb"]);
        fs::read(folder.path().join("picture.exr")).unwrap()
    };
    let first = bits();
    for process in 1..6 {
        assert!(bits() == first, "process {process} rendered another picture");
    }
}

#[test]
fn what_is_not_a_number_is_dropped_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut albedo = [0.9; 8];
    albedo[5] = f32::NAN;
    write_scene(folder.path(), albedo);
    let messages = render(folder.path(), "picture.exr", &[]);
    assert!(messages.contains("photons were not finite and were dropped"), "{messages}");
    let stats = fs::read_to_string(folder.path().join("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&stats).unwrap();
    let dropped = stats["counters"]["dropped_photons"].as_u64().unwrap();
    let collided = stats["counters"]["medium_photons"].as_u64().unwrap();
    assert!(dropped > 0 && dropped < collided, "{dropped} dropped, {collided} kept");
    let picture = Image::read_exr(&folder.path().join("picture.exr"), "").unwrap();
    assert!(picture.mean().into_iter().all(|value| value.is_finite() && value > 0.0));
}

/// The room's picture is about 20 % off after four jitters of 4 passes; 10 % takes more passes than the
/// scene's three, which do not count. The channels of errors hold what the number says: the mean of squared
/// errors over the squared picture, with the floor of a tenth of its mean, is its square, or up to twice
/// that, since pixels hold no negative squares where the bias is lost in its noise.
#[test]
fn target_error_ends_the_render_and_the_error_image_agrees_with_the_number() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), [0.9; 8]);
    let options = [
        "--target-error",
        "0.05",
        "--set",
        "error_image=true",
        "--set",
        "preset=paper",
        "--set",
        "radius_schedule=matched",
    ];
    render(folder.path(), "picture.exr", &options);
    let stats = fs::read(folder.path().join("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    assert_eq!(stats["ending"], "accuracy");
    let number = stats["estimated_error"]["relative"].as_f64().unwrap();
    assert!(number <= 0.05, "{number}");
    assert!(stats["passes"].as_u64().unwrap() >= 16, "{}", stats["passes"]);

    let path = folder.path().join("picture.exr");
    let [picture, error] = ["", "error."].map(|prefix| Image::read_exr(&path, prefix).unwrap());
    let floor = (0.1 * picture.mean().iter().sum::<f64>() / 3.0).powi(2);
    let values = picture.pixels.as_flattened().iter().zip(error.pixels.as_flattened());
    let squares = values.map(|(&x, &e)| f64::from(e).powi(2) / (f64::from(x).powi(2) + floor));
    let told = (squares.sum::<f64>() / (3 * picture.pixels.len()) as f64).sqrt();
    assert!((0.95..1.45).contains(&(told / number)), "{told} in the image, {number} told");

    render(folder.path(), "picture.png", &["--set", "error_image=true", "--passes", "8"]);
    assert_eq!(::image::open(folder.path().join("picture.png")).unwrap().width(), 24);
}

#[test]
fn no_error_is_estimated_where_none_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), [0.9; 8]);
    render(folder.path(), "picture.exr", &["--set", "estimate_error=false", "--passes", "8"]);
    let stats = fs::read(folder.path().join("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    assert!(stats["estimated_error"].is_null());
    assert!(Image::read_exr(&folder.path().join("picture.exr"), "error.").is_err());
    let refused = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .arg("render")
        .arg(folder.path().join("scene.xml"))
        .args(["--set", "estimate_error=false", "--set", "error_image=true"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        !refused.status.success() && message.contains("set estimate_error to true"),
        "{message}"
    );
}
