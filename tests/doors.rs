//! The three doors through which a scene can be rendered: the program `vpt`, Mitsuba's own program
//! with the plugin, and Mitsuba's Python module with the plugin. All must lead to the same picture;
//! whether it is right, other tests judge.

use exr::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;
use vpt::method::Method;
use vpt::picture::LayeredPicture;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const MITSUBA_DIR: &str = env!("VPT_MITSUBA_DIR");
const SCENE: &str = "mitsuba_scenes/cornell_fog/scene.xml";
const SIZE: usize = 32;

/// Stands for Mitsuba's own choice of a variant.
const DEFAULT: &str = "default";

/// A scene that every working variant of Mitsuba can render, without any part of ours.
const PROBE_SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"/>
    <emitter type="constant"/>
    <sensor type="perspective">
        <film type="hdrfilm">
            <integer name="width" value="4"/>
            <integer name="height" value="4"/>
        </film>
    </sensor>
</scene>
"#;

/// A lamp and a wall that it lights, with layers.
const LAYERED_SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt">
        <boolean name="layers" value="true"/><boolean name="connections" value="false"/>
        <integer name="photons" value="2000"/>
    </integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="3"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="16"/><integer name="height" value="16"/>
            <string name="component_format" value="float32"/><string name="pixel_format" value="rgb"/>
        </film>
    </sensor>
    <shape type="rectangle"><bsdf type="diffuse"/></shape>
    <shape type="sphere">
        <point name="center" x="0.5" y="0" z="1"/><float name="radius" value="0.2"/>
        <emitter type="area"><rgb name="radiance" value="4"/></emitter>
    </shape>
</scene>
"#;

/// Renders with the plugin. Says `absent` if the libraries are another Python's than this one.
const PYTHON: &str = r#"
import glob, os, sys, sysconfig
mitsuba_dir, plugin_dir, variant, scene, size, picture = sys.argv[1:]
site = os.path.dirname(mitsuba_dir)
if not glob.glob(os.path.join(site, "drjit", "_drjit_ext*" + sysconfig.get_config_var("EXT_SUFFIX"))):
    sys.exit("absent")
sys.path.insert(0, site)
import mitsuba as mi
mi.set_variant(variant)
mi.file_resolver().append(plugin_dir)
scene = mi.load_file(scene, resx=size, resy=size, spp=2)
image = mi.render(scene)
assert image.shape == (int(size), int(size), 3), image.shape
scene.sensors()[0].film().write(picture)
"#;

#[test]
fn vpt_renders_in_scalar_rgb() {
    vpt_renders("vpt_renders_in_scalar_rgb", "scalar_rgb");
}

#[test]
fn vpt_renders_in_llvm_ad_rgb() {
    vpt_renders("vpt_renders_in_llvm_ad_rgb", "llvm_ad_rgb");
}

#[test]
fn stock_program_renders_in_its_default_variant() {
    stock_program_renders("stock_program_renders_in_its_default_variant", DEFAULT);
}

#[test]
fn stock_program_renders_in_scalar_rgb() {
    stock_program_renders("stock_program_renders_in_scalar_rgb", "scalar_rgb");
}

/// Layers are further channels of Mitsuba's own film, so its own program writes them.
#[test]
fn stock_program_writes_layers() {
    let desk = Desk::new();
    let scene = desk.folder.path().join("scene.xml");
    std::fs::write(&scene, LAYERED_SCENE).unwrap();
    let mut mitsuba = stock_program("scalar_rgb");
    mitsuba.arg("-a").arg(plugin_dir()).arg("-o").arg(desk.picture()).arg(&scene);
    succeed(mitsuba);
    let (picture, _) = LayeredPicture::read(&desk.picture()).unwrap();
    let names: Vec<_> = picture.channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(names.len(), 3 + 10 + 3, "{names:?}");
    let mean = |name: &str| {
        let channel = picture.channel(name).unwrap_or_else(|| panic!("no channel {name}"));
        channel.iter().sum::<f32>() / channel.len() as f32
    };
    let layers = ["surfaces.G", "emission.G", "media.G"].map(mean);
    assert!(layers[0] > 0.0 && layers[1] > 0.0 && layers[2] == 0.0, "{layers:?}");
    assert!((layers.iter().sum::<f32>() / mean("G") - 1.0).abs() < 1e-5);
    assert!(mean("samples.Y") > 0.0 && mean("error.G") > 0.0);
}

#[test]
fn python_renders_in_scalar_rgb() {
    python_renders("python_renders_in_scalar_rgb", "scalar_rgb");
}

#[test]
fn python_renders_in_llvm_ad_rgb() {
    python_renders("python_renders_in_llvm_ad_rgb", "llvm_ad_rgb");
}

fn vpt_renders(test: &str, variant: &str) {
    if !can_render(test, variant) {
        return;
    }
    let desk = Desk::new();
    for method in Method::ALL.map(Method::name) {
        let mut vpt = program(env!("CARGO_BIN_EXE_vpt"));
        vpt.args(["render", SCENE, "--variant", variant, "--method", method, "--passes", "2"]);
        vpt.args(["--set", "photons=2000"]).args(size()).arg("-o").arg(desk.picture());
        succeed(vpt);
        assert!(mean_radiance(&desk.picture()) > 0.0, "{method}: the picture is black");
    }
}

fn stock_program_renders(test: &str, variant: &str) {
    if !can_render(test, variant) {
        return;
    }
    let desk = Desk::new();
    let mut mitsuba = stock_program(variant);
    mitsuba.arg("-a").arg(plugin_dir()).args(["-D", "spp=2"]).args(size());
    mitsuba.arg("-o").arg(desk.picture()).arg(SCENE);
    succeed(mitsuba);
    judge(&desk.picture());
}

fn python_renders(test: &str, variant: &str) {
    if !can_render(test, variant) {
        return;
    }
    let desk = Desk::new();
    let mut python = program("python3");
    python.args(["-c", PYTHON, MITSUBA_DIR]).arg(plugin_dir());
    python.args([variant, SCENE, &SIZE.to_string()]).arg(desk.picture());
    let output = run(&mut python);
    if String::from_utf8_lossy(&output.stderr).trim() == "absent" {
        return skip(test, "python3 cannot import the Mitsuba that vpt was built against");
    }
    expect_success(&python, &output);
    judge(&desk.picture());
}

/// A folder of its own for one test's picture.
struct Desk {
    folder: TempDir,
}

impl Desk {
    fn new() -> Self {
        Desk { folder: tempfile::tempdir().unwrap() }
    }

    fn picture(&self) -> PathBuf {
        self.folder.path().join("picture.exr")
    }
}

/// A program as a user would start it: Cargo's own search path for libraries must not help it.
fn program(name: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(name);
    command.current_dir(ROOT).env_remove("LD_LIBRARY_PATH");
    command
}

fn stock_program(variant: &str) -> Command {
    let mut command = program(Path::new(MITSUBA_DIR).join("mitsuba"));
    if variant != DEFAULT {
        command.args(["-m", variant]);
    }
    command
}

fn size() -> [String; 4] {
    ["-D".into(), format!("resx={SIZE}"), "-D".into(), format!("resy={SIZE}")]
}

fn run(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|e| panic!("{command:?} cannot be run: {e}"))
}

fn expect_success(command: &Command, output: &Output) {
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success(),
        "{command:?} ended with {}:\n{}{}",
        output.status,
        said(&output.stdout),
        said(&output.stderr)
    );
}

fn succeed(mut command: Command) -> Output {
    let output = run(&mut command);
    expect_success(&command, &output);
    output
}

/// The folder that `vpt plugin-dir` prints; filled once.
fn plugin_dir() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let mut vpt = program(env!("CARGO_BIN_EXE_vpt"));
        vpt.arg("plugin-dir");
        let printed = String::from_utf8(succeed(vpt).stdout).unwrap();
        let folder = PathBuf::from(printed.trim_end_matches('\n'));
        assert!(folder.join("plugins").is_dir(), "{folder:?} holds no plugins");
        folder
    })
}

/// Tells whether Mitsuba by itself renders in a variant, and names the test as skipped if not: there
/// may be no libLLVM, or one too old for Dr.Jit, which then ends the process.
/// With VPT_REQUIRE_LLVM=1 that is a failure.
fn can_render(test: &str, variant: &str) -> bool {
    let desk = Desk::new();
    let scene = desk.folder.path().join("probe.xml");
    std::fs::write(&scene, PROBE_SCENE).unwrap();
    let mut mitsuba = stock_program(variant);
    mitsuba.arg("-o").arg(desk.picture()).arg(&scene);
    let output = run(&mut mitsuba);
    let must_use_jit = std::env::var_os("VPT_REQUIRE_LLVM").is_some_and(|value| value == "1");
    let chose_scalar =
        String::from_utf8_lossy(&output.stdout).contains(r#"Rendering using the "scalar_rgb""#);
    if variant == DEFAULT && must_use_jit {
        assert!(!chose_scalar, "VPT_REQUIRE_LLVM is set, but Mitsuba finds no libLLVM");
    }
    if variant == "scalar_rgb" || must_use_jit {
        expect_success(&mitsuba, &output);
    }
    if !output.status.success() {
        skip(test, &format!("Mitsuba itself cannot render in the variant {variant} here"));
    }
    output.status.success()
}

/// Says so in the log of the tests, past the capture of what a test prints.
fn skip(test: &str, reason: &str) {
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {reason}");
}

fn judge(picture: &Path) {
    let ratio = mean_radiance(picture) / reference();
    assert!((0.9..1.1).contains(&ratio), "the picture is {ratio} times as bright as vpt's own");
}

/// Mean of a picture's colours; the picture must be of the right size and finite.
fn mean_radiance(picture: &Path) -> f32 {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(picture)
        .unwrap_or_else(|e| panic!("{picture:?} cannot be read: {e}"));
    let layer = &image.layer_data;
    assert_eq!(layer.size, Vec2(SIZE, SIZE));
    let mut values = Vec::new();
    for name in ["R", "G", "B"] {
        let channel = layer.channel_data.list.iter().find(|channel| channel.name.eq(name));
        let channel = channel.unwrap_or_else(|| panic!("{picture:?} has no channel {name}"));
        values.extend(channel.sample_data.values_as_f32());
    }
    assert!(values.iter().all(|value| value.is_finite()));
    values.iter().sum::<f32>() / values.len() as f32
}

/// Mean radiance of the picture that `vpt` makes of the scene as it stands.
fn reference() -> f32 {
    static MEAN: OnceLock<f32> = OnceLock::new();
    *MEAN.get_or_init(|| {
        let desk = Desk::new();
        let mut vpt = program(env!("CARGO_BIN_EXE_vpt"));
        vpt.args(["render", SCENE, "--variant", "scalar_rgb", "-D", "spp=2"]).args(size());
        vpt.arg("-o").arg(desk.picture());
        succeed(vpt);
        mean_radiance(&desk.picture())
    })
}
