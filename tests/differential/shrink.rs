//! Takes a scene apart as long as what is wrong with it stays.

use super::scene::*;

/// The smallest scene found from which nothing can be taken without `fails` becoming false.
pub fn shrink(scene: Scene, fails: impl Fn(&Scene) -> bool) -> Scene {
    let mut smallest = scene;
    while let Some(smaller) = simpler(&smallest).into_iter().find(|scene| fails(scene)) {
        smallest = smaller;
    }
    smallest
}

/// All scenes one step simpler, those first that lack most. No step undoes another, so steps end.
fn simpler(scene: &Scene) -> Vec<Scene> {
    let mut scenes = Vec::new();
    let mut offer = |change: &dyn Fn(&mut Scene)| {
        let mut changed = scene.clone();
        change(&mut changed);
        if changed != *scene && changed.has_light() {
            scenes.push(changed);
        }
    };
    for i in 0..scene.objects.len() {
        offer(&|scene| drop(scene.objects.remove(i)));
    }
    for i in 0..scene.lamps.len() {
        offer(&|scene| drop(scene.lamps.remove(i)));
    }
    offer(&|scene| scene.air = None);
    for (i, object) in scene.objects.iter().enumerate() {
        for smaller in simpler_objects(object) {
            offer(&|scene| scene.objects[i] = smaller.clone());
        }
    }
    if let Some(air) = &scene.air {
        simpler_media(air)
            .into_iter()
            .for_each(|air| offer(&|scene| scene.air = Some(air.clone())));
    }
    offer(&simplify_surroundings);
    offer(&|scene| scene.hide_emitters = false);
    let depth = scene.max_depth.unwrap_or(8);
    for depth in [2, depth.saturating_sub(1).max(2)] {
        offer(&|scene| scene.max_depth = Some(depth));
    }
    scenes
}

fn simplify_surroundings(scene: &mut Scene) {
    match &mut scene.surroundings {
        Surroundings::Room(walls) => *walls = Bsdf::TwoSided(Box::new(plain())),
        Surroundings::Box { boundary, .. } => *boundary = Bsdf::Null,
        Surroundings::Open { floor } => *floor = None,
    }
}

fn plain() -> Bsdf {
    Bsdf::Diffuse([0.5; 3])
}

fn simpler_objects(object: &Object) -> Vec<Object> {
    let mut objects: Vec<Object> = object.content.as_deref().cloned().into_iter().collect();
    let mut offer = |change: &dyn Fn(&mut Object)| {
        let mut changed = object.clone();
        change(&mut changed);
        if changed != *object {
            objects.push(changed);
        }
    };
    offer(&|object| object.content = None);
    offer(&|object| object.inside = None);
    for bsdf in simpler_bsdfs(&object.bsdf) {
        offer(&|object| object.bsdf = bsdf.clone());
    }
    offer(&|object| object.shape = Shape::Sphere);
    offer(&|object| (object.stretch, object.degrees) = ([1.0; 3], 0.0));
    if let Some(inside) = &object.inside {
        let media = simpler_media(inside);
        media.into_iter().for_each(|medium| offer(&|object| object.inside = Some(medium.clone())));
    }
    if let Some(content) = &object.content {
        for content in simpler_objects(content) {
            offer(&|object| object.content = Some(Box::new(content.clone())));
        }
    }
    objects
}

/// Boundaries become null ones, all others diffuse.
fn simpler_bsdfs(bsdf: &Bsdf) -> Vec<Bsdf> {
    let mut bsdfs: Vec<Bsdf> = bsdf.parts().into_iter().cloned().collect();
    match bsdf {
        Bsdf::Dielectric { .. }
        | Bsdf::ThinDielectric { .. }
        | Bsdf::RoughDielectric { .. }
        | Bsdf::Mask { .. } => bsdfs.push(Bsdf::Null),
        Bsdf::Null => {}
        _ => bsdfs.push(plain()),
    }
    bsdfs
}

fn simpler_media(medium: &Medium) -> Vec<Medium> {
    let mut media = Vec::new();
    let mut offer = |medium: Medium| media.push(medium);
    match &medium.extinction {
        Extinction::Grid(values) => {
            let extinction = Extinction::Constant(values[values.len() / 2]);
            offer(Medium { extinction, ..medium.clone() });
        }
        Extinction::Constant(colour) => {
            offer(Medium { extinction: Extinction::Constant([colour[0]; 3]), ..medium.clone() });
        }
    }
    offer(Medium { albedo: [medium.albedo[0]; 3], ..medium.clone() });
    match &medium.phase {
        Phase::Blend { parts, .. } => {
            parts.iter().for_each(|part| offer(Medium { phase: *part.clone(), ..medium.clone() }));
        }
        _ => offer(Medium { phase: Phase::Isotropic, ..medium.clone() }),
    }
    media.retain(|smaller| smaller != medium);
    media
}

/// A scene that fails because of one glass ball and the lamp above it is left with these two, whatever
/// else was in it.
#[test]
fn what_does_not_matter_is_taken_away() {
    let glass = |scene: &Scene| {
        scene.objects.iter().any(|object| matches!(object.bsdf, Bsdf::Dielectric { .. }))
    };
    let scene = (0..1000)
        .map(super::generator::generate)
        .find(|scene| glass(scene) && scene.objects.len() > 3 && !scene.lamps.is_empty())
        .expect("one of many scenes has glass");
    let small = shrink(scene, glass);
    assert!(small.has_light() && glass(&small));
    assert_eq!((small.objects.len(), small.lamps.len(), small.media().len()), (1, 1, 0));
    assert!(small.objects[0].content.is_none() && small.objects[0].shape == Shape::Sphere);
}
