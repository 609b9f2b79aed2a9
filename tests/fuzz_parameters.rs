//! The integrator's parameters under whatever a scene or a command line may say: every parameter, values of every
//! kind, several at a time.
//!
//! What must hold: the scene loads or is refused with a sentence that names the parameter or its value; one that
//! loads renders to finite pixels. `just fuzz` gives the generator more cases.

use proptest::prelude::*;
use proptest::sample::{select, subsequence};
use proptest::test_runner::{Config, TestRunner};
use std::path::PathBuf;
use tempfile::TempDir;
use vpt::host::session::{SceneFile, Session};
use vpt::method::Silent;

/// A ball of fog on a floor.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt"><integer name="photons" value="200"/></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0,-5,1" target="0,0,1" up="0,0,1"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/></film>
        <sampler type="independent"><integer name="sample_count" value="2"/></sampler>
    </sensor>
    <emitter type="point">
        <point name="position" x="0" y="0" z="3"/>
        <rgb name="intensity" value="5"/>
    </emitter>
    <shape type="rectangle"/>
    <shape type="sphere">
        <point name="center" x="0" y="0" z="1"/>
        <bsdf type="null"/>
        <medium name="interior" type="homogeneous">
            <rgb name="sigma_t" value="0.2, 0.5, 1"/>
            <rgb name="albedo" value="0.8"/>
        </medium>
    </shape>
</scene>"#;

/// Parameters, with values that are right.
const PARAMETERS: [(&str, &[&str]); 24] = [
    ("method", &["ppt", "ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"]),
    ("preset", &["fast", "paper"]),
    ("connections", &["true", "false", "auto"]),
    ("emission_rays", &["true", "false"]),
    ("glossy_chains", &["true", "false"]),
    ("guided_emission", &["true", "false"]),
    ("connection_samples", &["0", "1", "5"]),
    ("jitter_every", &["0", "1", "3"]),
    ("alpha", &["0.5", "0.99"]),
    ("surface_radius", &["0", "0.1", "1e-20"]),
    ("medium_radius", &["0", "0.1", "1e-20"]),
    ("radius_schedule", &["matched", "paper"]),
    ("shooting", &["uniform", "metropolis", "auto"]),
    ("photon_beams", &["short", "long"]),
    ("chains", &["0", "5"]),
    ("effects", &["auto", "all", "view_beams"]),
    ("max_depth", &["-1", "0", "1", "2", "9"]),
    ("rr_depth", &["1", "1000"]),
    ("hide_emitters", &["true", "false"]),
    ("estimate_error", &["true", "false"]),
    ("target_error", &["0", "0.5"]),
    ("error_image", &["true", "false"]),
    ("layers", &["true", "false"]),
    ("timeout", &["-1", "1", "1e300"]),
];

/// Values that are right for some parameters and wrong for others.
const ODD: [&str; 18] = [
    "",
    " ",
    "0",
    "-0",
    "-1",
    "1",
    "0.5",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "9223372036854775808",
    "0x10",
    "true",
    "yes",
    "$x",
    "auto",
];

fn settings() -> impl Strategy<Value = Vec<(String, String)>> {
    let some = subsequence(PARAMETERS.to_vec(), 0..6);
    some.prop_flat_map(|parameters| {
        let value = |(name, right): (&'static str, &'static [&'static str])| {
            let value = prop_oneof![
                6 => select(right).prop_map(str::to_owned),
                2 => select(&ODD[..]).prop_map(str::to_owned),
                1 => "[ -~]{0,10}",
            ];
            value.prop_map(move |value| (name.to_owned(), value))
        };
        parameters.into_iter().map(value).collect::<Vec<_>>()
    })
}

#[test]
fn any_parameters_render_or_are_refused_by_name() {
    let session = Session::start(Some("scalar_rgb"), Some(2), 0).unwrap();
    let folder = TempDir::new().unwrap();
    let path: PathBuf = folder.path().join("scene.xml");
    std::fs::write(&path, SCENE).unwrap();
    let cases =
        if std::env::var_os("PROPTEST_CASES").is_some() { Config::default().cases } else { 1000 };
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let (rendered, refused) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
    let result = TestRunner::new(config).run(&settings(), |settings| {
        let file =
            SceneFile { path: path.clone(), settings: settings.clone(), ..Default::default() };
        match session.load(&file) {
            Err(error) => {
                let sentence = error.to_string();
                let named = |(name, value): &(String, String)| {
                    sentence.contains(name.as_str())
                        || (!value.is_empty() && sentence.contains(value.as_str()))
                };
                prop_assert!(settings.iter().any(named), "{sentence}");
                prop_assert!(!sentence.contains("internal error"), "{sentence}");
                refused.set(refused.get() + 1);
            }
            Ok(mut scene) => {
                let stats = scene.render(0, 1, None, &mut Silent);
                prop_assert!(stats.is_ok(), "{}", stats.unwrap_err());
                let finite = scene.read_rgb().unwrap().iter().all(|value| value.is_finite());
                prop_assert!(finite);
                rendered.set(rendered.get() + 1);
            }
        }
        Ok(())
    });
    result.unwrap();
    // Neither all right nor all wrong.
    assert!(5 * rendered.get() > cases && 10 * refused.get() > cases, "{rendered:?} {refused:?}");
}
