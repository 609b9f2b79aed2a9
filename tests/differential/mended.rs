//! Faults of ours that random scenes found, each as the smallest scene that shows it.

use super::scene::*;
use super::{session, xml};
use vpt::host::session::SceneFile;
use vpt::method::{Method, Silent};

/// A lamp at the eye lights a sheet of one-sided `diffuse`, turned by so much about the upright axis.
fn sheet(degrees: f32) -> Scene {
    Scene {
        surroundings: Surroundings::Open { floor: None },
        air: None,
        objects: vec![Object {
            shape: Shape::Rectangle,
            centre: [0.0; 3],
            radius: 1.0,
            stretch: [1.0; 3],
            axis: [0.0, 1.0, 0.0],
            degrees,
            bsdf: Bsdf::Diffuse([0.5; 3]),
            radiance: None,
            inside: None,
            content: None,
            names_medium: false,
        }],
        lamps: vec![Lamp::Point { position: [0.0, 0.0, 3.0], intensity: [1.0; 3] }],
        camera: Camera { origin: [0.0, 0.0, 3.0], target: [0.0; 3], fov: 20.0 },
        max_depth: Some(2),
        rr_depth: 5,
        hide_emitters: false,
    }
}

/// Light that falls on the back of a one-sided sheet is not reflected, and the eye there sees none; of the
/// front it does.
#[test]
fn a_one_sided_sheet_is_black_from_behind() {
    let session = session();
    for method in Method::ALL {
        let folder = tempfile::tempdir().unwrap();
        let mean = |degrees: f32| {
            xml::write(&sheet(degrees), folder.path()).unwrap();
            let mut scene = session
                .load(&SceneFile {
                    path: folder.path().join("scene.xml"),
                    method: Some(method.name().to_owned()),
                    settings: vec![("photons".to_owned(), "10000".to_owned())],
                    ..SceneFile::default()
                })
                .unwrap();
            scene.render(0, 1, Some(1), &mut Silent).unwrap();
            scene.read_rgb().unwrap().iter().sum::<f32>()
        };
        assert!(mean(0.0) > 0.0, "{}", method.name());
        assert_eq!(mean(180.0), 0.0, "{}", method.name());
    }
}
