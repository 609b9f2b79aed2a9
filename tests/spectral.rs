//! `scalar_spectral` against quadrature over wavelengths, and each kind of lamp's photons against Mitsuba's path tracer.

use std::fs;
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use statistics::t_test::Estimate;
use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::method::Silent;
use vpt::scene::PathLimits;

#[path = "support/cie.rs"]
mod cie;

/// With one jitter each: 96 wavelengths at equal distances.
const PASSES: u32 = 32;
/// Pictures of a lamp, whose colours differ by 0.5 to 1.8 %.
const SEEDS: u32 = 16;
const SPP: u32 = 1024;

fn session() -> MutexGuard<'static, Session> {
    static SESSION: OnceLock<Mutex<Session>> = OnceLock::new();
    let start = || {
        let session = Session::start(Some("scalar_spectral"), None, 0).unwrap();
        let limits = PathLimits { max_depth: 2, rr_depth: 64, hide_emitters: false };
        session.integrator("path", limits).expect("plugins are found before any scene is loaded");
        Mutex::new(session)
    };
    SESSION.get_or_init(start).lock().unwrap_or_else(PoisonError::into_inner)
}

/// The scene of these parts behind a camera and a small film.
fn scene(camera: &str, parts: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <integrator type="vpt"><integer name="max_depth" value="2"/></integrator>
    <sensor type="perspective">
        {camera}
        <sampler type="independent"/>
        <film type="hdrfilm">
            <integer name="width" value="16"/><integer name="height" value="16"/>
            <string name="component_format" value="float32"/>
            <string name="pixel_format" value="rgb"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    {parts}
</scene>"#
    )
}

fn load<'a>(session: &'a Session, xml: &str, settings: &[(&str, &str)]) -> LoadedScene<'a> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, xml).unwrap();
    let settings = settings.iter().map(|&(name, value)| (name.to_owned(), value.to_owned()));
    let file = SceneFile { path, settings: settings.collect(), ..SceneFile::default() };
    session.load(&file).unwrap()
}

/// The mean colour of vpt's picture.
fn rendered(session: &Session, xml: &str, settings: &[(&str, &str)]) -> [f64; 3] {
    of_seeds(session, xml, settings, 1..2)[0]
}

/// The same of one picture for each seed.
fn of_seeds(
    session: &Session,
    xml: &str,
    settings: &[(&str, &str)],
    seeds: Range<u32>,
) -> Vec<[f64; 3]> {
    let mut scene = load(session, xml, settings);
    let render = |seed| {
        scene.render(0, seed, Some(PASSES), &mut Silent).unwrap();
        mean(&scene.read_rgb().unwrap())
    };
    seeds.map(render).collect()
}

/// The mean colour by Mitsuba's path tracer.
fn traced(session: &Session, xml: &str) -> [f64; 3] {
    let limits = PathLimits { max_depth: 2, rr_depth: 64, hide_emitters: false };
    let path = session.integrator("path", limits).unwrap();
    mean(&load(session, xml, &[]).render_with(&path, 0, 7, SPP).unwrap().rgb)
}

fn mean(rgb: &[f32]) -> [f64; 3] {
    let channel = |i: usize| rgb.iter().skip(i).step_by(3).map(|&v| f64::from(v)).sum::<f64>();
    [0, 1, 2].map(|i| channel(i) / (rgb.len() / 3) as f64)
}

/// Every channel is within `tolerance` of the expected one, as a share of the brightest.
fn assert_close(name: &str, actual: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let scale = expected.iter().copied().fold(0.0, f64::max);
    assert!(scale > 0.0, "{name}: nothing was expected");
    println!("{name}: {actual:.4?}, expected {expected:.4?}");
    for i in 0..3 {
        let error = (actual[i] - expected[i]).abs() / scale;
        assert!(error < tolerance, "{name}: {actual:?} instead of {expected:?}, off by {error}");
    }
}

const EMISSION: [(f64, f64); 3] = [(400.0, 1.0), (550.0, 3.0), (700.0, 2.0)];
const EXTINCTION: [(f64, f64); 4] = [(360.0, 0.2), (500.0, 0.3), (600.0, 2.5), (830.0, 1.0)];
const REFLECTANCE: [(f64, f64); 3] = [(360.0, 0.2), (520.0, 0.8), (830.0, 0.6)];

/// As Mitsuba reads it.
fn written(spectrum: &[(f64, f64)]) -> String {
    let points: Vec<String> = spectrum.iter().map(|(nm, value)| format!("{nm}:{value}")).collect();
    points.join(", ")
}

/// A slab of dye that absorbs, 1 thick across y.
fn slab(lower: f64) -> String {
    format!(
        r#"<shape type="cube">
        <transform name="to_world">
            <scale x="4" y="0.5" z="4"/><translate y="{}"/>
        </transform>
        <bsdf type="null"/>
        <medium type="homogeneous" name="interior">
            <spectrum name="sigma_t" value="{}"/>
            <float name="albedo" value="0"/>
        </medium>
    </shape>"#,
        lower + 0.5,
        written(&EXTINCTION)
    )
}

const NARROW_CAMERA: &str = r#"<float name="fov" value="2"/>
    <transform name="to_world"><lookat origin="0, -3, 0" target="0, 0, 0" up="0, 0, 1"/></transform>"#;

/// Looked at through a slab of absorbing fog, a lamp of radiance `L` has the colour of `L(nm) exp(-sigma_t(nm))`. A camera of 2
/// degrees sees at most `1 / cos 1° - 1 = 1.5e-4` more fog; the lines' kinks leave less than 3e-3 at 96 wavelengths.
#[test]
fn fog_filters_what_is_seen_wavelength_by_wavelength() {
    let lamp = format!(
        r#"<shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><translate y="2"/></transform>
        <emitter type="area"><spectrum name="radiance" value="{}"/></emitter>
    </shape>"#,
        written(&EMISSION)
    );
    let xml = scene(NARROW_CAMERA, &(lamp + &slab(0.0)));
    let filtered = |nm| cie::piecewise(&EMISSION, nm) * (-cie::piecewise(&EXTINCTION, nm)).exp();
    assert_close("lamp", rendered(&session(), &xml, &[]), cie::srgb(filtered), 5e-3);
}

/// A floor of reflectance `rho` under parallel light of irradiance `E` that crosses the fog has the radiance
/// `rho E exp(-sigma_t) / pi`, wavelength by wavelength: by photons within their noise, by connections as above.
#[test]
fn fog_filters_what_lamps_send_wavelength_by_wavelength() {
    let camera = r#"<float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0, 0.9, -1" target="0, 0, 0" up="0, 1, 0"/></transform>"#;
    let parts = format!(
        r#"<shape type="rectangle">
        <transform name="to_world"><scale value="3"/><rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><spectrum name="reflectance" value="{}"/></bsdf>
    </shape>
    <emitter type="directional">
        <vector name="direction" x="0" y="-1" z="0"/>
        <spectrum name="irradiance" value="{}"/>
    </emitter>
    {}"#,
        written(&REFLECTANCE),
        written(&EMISSION),
        slab(1.0)
    );
    let xml = scene(camera, &parts);
    let radiance = |nm| {
        cie::piecewise(&REFLECTANCE, nm)
            * cie::piecewise(&EMISSION, nm)
            * (-cie::piecewise(&EXTINCTION, nm)).exp()
            / std::f64::consts::PI
    };
    let (session, expected) = (session(), cie::srgb(radiance));
    let connected = rendered(&session, &xml, &[("connections", "true"), ("photons", "1000")]);
    assert_close("connections", connected, expected, 5e-3);
    let shot = rendered(&session, &xml, &[("connections", "false"), ("photons", "20000")]);
    assert_close("photons", shot, expected, 0.02);
}

/// A sensor's response function weighs wavelengths and chooses them: a lamp of radiance `L` has the colour of `L(nm) S(nm)` behind it, here
/// within 5e-3.
#[test]
fn a_response_function_filters_wavelengths() {
    const RESPONSE: [(f64, f64); 3] = [(480.0, 0.0), (560.0, 1.0), (640.0, 0.0)];
    let lamp = format!(
        r#"<shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><translate y="2"/></transform>
        <emitter type="area"><spectrum name="radiance" value="{}"/></emitter>
    </shape>"#,
        written(&EMISSION)
    );
    let response = format!(r#"<spectrum name="srf" value="{}"/>"#, written(&RESPONSE));
    let xml = scene(&format!("{NARROW_CAMERA}{response}"), &lamp);
    let seen = |nm| cie::piecewise(&EMISSION, nm) * cie::piecewise(&RESPONSE, nm);
    assert_close("response", rendered(&session(), &xml, &[]), cie::srgb(seen), 5e-3);
}

const FLOOR: &str = r#"<shape type="rectangle">
        <transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><spectrum name="reflectance" value="360:0.2, 520:0.8, 830:0.6"/></bsdf>
    </shape>"#;
const CAMERA: &str = r#"<float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0, 2, -3" target="0, 0, 0" up="0, 1, 0"/></transform>"#;

/// A lamp as wide as the floor above it, which shines down.
fn panel(emitter: &str) -> String {
    format!(
        r#"<shape type="rectangle">
        <transform name="to_world">
            <scale value="4"/><rotate x="1" angle="90"/><translate y="2.5"/>
        </transform>
        {emitter}
    </shape>"#
    )
}

/// Mitsuba's own lamps, and what else shines on the floor as they do where its path tracer cannot find them.
fn lamps() -> Vec<(&'static str, String, Option<String>)> {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/agreement/scenes/assets");
    let asset = |name: &str| assets.join(name).display().to_string();
    let bitmap = |name: &str, file: &str| {
        let file = asset(file);
        format!(
            r#"<texture name="{name}" type="bitmap"><string name="filename" value="{file}"/></texture>"#
        )
    };
    let light = written(&EMISSION);
    let down = r#"<transform name="to_world">
        <lookat origin="0.3, 2.5, 0" target="0, 0, 0" up="0, 0, 1"/></transform>"#;
    let parallel = format!(
        r#"<emitter type="directional"><vector name="direction" x="0" y="-1" z="0"/>
        <spectrum name="irradiance" value="{light}"/></emitter>"#
    );
    vec![
        (
            "point",
            format!(
                r#"<emitter type="point"><point name="position" x="0.5" y="1.5" z="0"/>
                <spectrum name="intensity" value="{light}"/></emitter>"#
            ),
            None,
        ),
        (
            "spot",
            format!(
                r#"<emitter type="spot">{down}<rgb name="intensity" value="5, 3, 1"/>
                <float name="cutoff_angle" value="40"/>{}</emitter>"#,
                bitmap("texture", "slide.png")
            ),
            None,
        ),
        (
            "area",
            panel(r#"<emitter type="area"><rgb name="radiance" value="1, 2, 4"/></emitter>"#),
            None,
        ),
        (
            "textured area",
            panel(&format!(
                r#"<emitter type="area">{}</emitter>"#,
                bitmap("radiance", "colours.png")
            )),
            None,
        ),
        ("directional", parallel.clone(), None),
        (
            "directionalarea",
            panel(&format!(
                r#"<emitter type="directionalarea"><spectrum name="radiance" value="{light}"/></emitter>"#
            )),
            Some(parallel),
        ),
        (
            "constant",
            format!(
                r#"<emitter type="constant"><spectrum name="radiance" value="{light}"/></emitter>"#
            ),
            None,
        ),
        (
            "envmap",
            format!(
                r#"<emitter type="envmap"><string name="filename" value="{}"/></emitter>"#,
                asset("sky.exr")
            ),
            None,
        ),
        (
            "sunsky",
            r#"<emitter type="sunsky"><vector name="sun_direction" x="0.5" y="0.6" z="0.8"/>
            <transform name="to_world"><rotate x="1" angle="-90"/></transform></emitter>"#
                .to_owned(),
            None,
        ),
        (
            "projector",
            format!(
                r#"<emitter type="projector">{down}<float name="fov" value="60"/>{}</emitter>"#,
                bitmap("irradiance", "slide.png")
            ),
            None,
        ),
    ]
}

/// Photons carry all light that scatters. Each channel is judged as a share of the brightest. Two sides differ by 1 % at most: 3e5
/// paths are traced, and the kernel reaches over the edges of pictures.
#[test]
fn photons_of_every_kind_of_lamp_have_its_colours() {
    let session = session();
    for (name, lamp, stand_in) in lamps() {
        let of = |lamp: &str| scene(CAMERA, &format!("{FLOOR}\n{lamp}"));
        let expected = traced(&session, &of(stand_in.as_deref().unwrap_or(&lamp)));
        let settings = [("connections", "false"), ("photons", "10000"), ("surface_radius", "0.06")];
        let pictures = of_seeds(&session, &of(&lamp), &settings, 1..1 + SEEDS);
        let brightest = expected.into_iter().fold(0.0, f64::max);
        for channel in 0..3 {
            let off = |rgb: &[f64; 3]| 1.0 + (rgb[channel] - expected[channel]) / brightest;
            let estimate = Estimate::of(&pictures.iter().map(off).collect::<Vec<_>>());
            estimate.assert_noticing(0.08, &format!("{name}, channel {channel}"), 1.0, 0.01);
        }
    }
}
