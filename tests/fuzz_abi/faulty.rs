//! A scene that goes wrong at a chosen call.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use vpt::scene::*;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The call fails.
    Fails,
    /// Values of the answer are not numbers, or are infinite.
    NotANumber,
    Infinite,
    /// Flux, weights and reflectances are negative or enormous.
    Negative,
    Enormous,
    /// Vertices lie far away, or all in one place.
    Far,
    Together,
    /// Bits and indices are arbitrary.
    WildFlags,
    WildMedium,
    WildDepth,
    WildWalk,
    Panics,
}

impl Fault {
    pub const SENSELESS: [Fault; 11] = [
        Fault::NotANumber,
        Fault::Infinite,
        Fault::Negative,
        Fault::Enormous,
        Fault::Far,
        Fault::Together,
        Fault::WildFlags,
        Fault::WildMedium,
        Fault::WildDepth,
        Fault::WildWalk,
        Fault::Panics,
    ];

    /// What takes the place of a value, if anything does.
    fn value(self) -> Option<f32> {
        match self {
            Fault::NotANumber => Some(f32::NAN),
            Fault::Infinite => Some(f32::INFINITY),
            Fault::Negative => Some(-1.0),
            Fault::Enormous => Some(f32::MAX),
            _ => None,
        }
    }

    /// What takes the place of a coordinate, if anything does.
    fn coordinate(self) -> Option<f32> {
        match self {
            Fault::NotANumber => Some(f32::NAN),
            Fault::Infinite => Some(f32::INFINITY),
            Fault::Far => Some(3e38),
            Fault::Together => Some(0.0),
            _ => None,
        }
    }
}

/// Another scene, until call number `at`; from there on every answer is wrong.
pub struct Faulty<'a> {
    inner: &'a dyn Scene,
    fault: Fault,
    at: u32,
    calls: AtomicU32,
    struck: AtomicBool,
}

impl<'a> Faulty<'a> {
    pub fn new(inner: &'a dyn Scene, fault: Fault, at: u32) -> Self {
        Faulty { inner, fault, at, calls: AtomicU32::new(0), struck: AtomicBool::new(false) }
    }

    /// Whether anything has gone wrong yet.
    pub fn struck(&self) -> bool {
        self.struck.load(Ordering::Relaxed)
    }

    /// Counts a call; the fault, if it strikes now.
    fn strike(&self) -> SceneResult<Option<Fault>> {
        if self.calls.fetch_add(1, Ordering::Relaxed) < self.at {
            return Ok(None);
        }
        self.struck.store(true, Ordering::Relaxed);
        match self.fault {
            Fault::Fails => Err(SceneError("this call fails on purpose".to_owned())),
            Fault::Panics => panic!("this call panics on purpose"),
            fault => Ok(Some(fault)),
        }
    }

    fn spoil_values(&self, values: &mut Planes) -> SceneResult<()> {
        if let Some(value) = self.strike()?.and_then(Fault::value) {
            values.as_mut_slice().fill(value);
        }
        Ok(())
    }
}

struct FaultyView<'a> {
    scene: &'a Faulty<'a>,
    walk: Box<dyn ViewWalk + 'a>,
}

impl ViewWalk for FaultyView<'_> {
    fn lanes(&self) -> usize {
        self.walk.lanes()
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut ViewVertices) -> SceneResult<()> {
        self.walk.step(steps, numbers, out)?;
        let Some(fault) = self.scene.strike()? else { return Ok(()) };
        if let Some(value) = fault.value() {
            for planes in [&mut out.reflectance, &mut out.emission, &mut out.weight] {
                planes.as_mut_slice().fill(value);
            }
            out.length.fill(value);
        }
        if let Some(coordinate) = fault.coordinate() {
            for planes in [&mut out.origin, &mut out.position] {
                planes.as_mut_slice().fill(coordinate);
            }
        }
        match fault {
            Fault::WildFlags => out.flags.iter_mut().for_each(|flags| *flags ^= 0x5555_5557),
            Fault::WildMedium => out.medium.fill(7),
            _ => {}
        }
        Ok(())
    }
}

struct FaultyPhotons<'a> {
    scene: &'a Faulty<'a>,
    walk: Box<dyn PhotonWalk + 'a>,
}

impl PhotonWalk for FaultyPhotons<'_> {
    fn lanes(&self) -> usize {
        self.walk.lanes()
    }

    fn alive(&self, out: &mut Vec<u32>) -> SceneResult<()> {
        self.walk.alive(out)
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut PhotonVertices) -> SceneResult<()> {
        self.walk.step(steps, numbers, out)?;
        let Some(fault) = self.scene.strike()? else { return Ok(()) };
        if let Some(value) = fault.value() {
            out.flux.as_mut_slice().fill(value);
            out.length.fill(value);
            if let Some(segments) = &mut out.segments {
                segments.flux.as_mut_slice().fill(value);
                segments.density.as_mut_slice().fill(value);
                segments.reach.fill(value);
            }
        }
        if let Some(coordinate) = fault.coordinate() {
            out.position.as_mut_slice().fill(coordinate);
            if let Some(segments) = &mut out.segments {
                segments.origin.as_mut_slice().fill(coordinate);
            }
        }
        match fault {
            Fault::WildFlags => out.event.iter_mut().for_each(|event| *event ^= 0xffff_fff5),
            Fault::WildMedium => out.medium.fill(7),
            Fault::WildDepth => out.depth.fill(u32::MAX),
            Fault::WildWalk => out.walk.fill(u32::MAX),
            _ => {}
        }
        Ok(())
    }
}

impl Scene for Faulty<'_> {
    fn description(&self) -> &SceneDescription {
        self.inner.description()
    }

    fn batching(&self) -> Batching {
        self.inner.batching()
    }

    fn view_rays<'a>(
        &'a self,
        request: &ViewRayRequest,
        importance: &mut Planes,
    ) -> SceneResult<Box<dyn ViewWalk + 'a>> {
        let walk = self.inner.view_rays(request, importance)?;
        self.spoil_values(importance)?;
        Ok(Box::new(FaultyView { scene: self, walk }))
    }

    fn emit<'a>(
        &'a self,
        lanes: usize,
        numbers: &[f32],
        rules: PathRules,
    ) -> SceneResult<Box<dyn PhotonWalk + 'a>> {
        self.strike()?;
        let walk = self.inner.emit(lanes, numbers, rules)?;
        Ok(Box::new(FaultyPhotons { scene: self, walk }))
    }

    fn extinction(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.inner.extinction(points, out)?;
        self.spoil_values(out)
    }

    fn scattering(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.inner.scattering(points, out)?;
        self.spoil_values(out)
    }

    fn eval_phase(&self, pairs: &PhasePairs, out: &mut Planes) -> SceneResult<()> {
        self.inner.eval_phase(pairs, out)?;
        self.spoil_values(out)
    }

    fn store_points(&self, points: &PointSegments) -> SceneResult<()> {
        self.strike()?;
        self.inner.store_points(points)
    }

    fn eval_bsdf(&self, pairs: &SurfacePairs, out: &mut Planes) -> SceneResult<()> {
        self.inner.eval_bsdf(pairs, out)?;
        self.spoil_values(out)
    }

    fn lamp_light(&self, places: &Places, numbers: &[f32], out: &mut LampLight) -> SceneResult<()> {
        self.inner.lamp_light(places, numbers, out)?;
        self.spoil_values(&mut out.direction)?;
        self.spoil_values(&mut out.irradiance)
    }
}
