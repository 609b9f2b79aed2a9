//! A [`World`] as the engine sees it.

use super::lamp_light;
use super::phase;
use super::photon_walk::Photons;
use super::ray::Ray;
use super::view_walk::ViewRays;
use super::world::World;
use crate::math::Rgb;
use crate::scene::*;
use std::f64::consts::PI;

impl Scene for World {
    fn description(&self) -> &SceneDescription {
        &self.description
    }

    fn batching(&self) -> Batching {
        self.batching
    }

    fn tuned(&self, number: f32) -> SceneResult<Option<Box<dyn Scene + '_>>> {
        Ok(self.at(number).map(|world| -> Box<dyn Scene> { Box::new(world) }))
    }

    fn view_rays<'a>(
        &'a self,
        request: &ViewRayRequest,
        importance: &mut Planes,
    ) -> SceneResult<Box<dyn ViewWalk + 'a>> {
        importance.resize(request.lanes);
        importance.as_mut_slice().fill(1.0);
        Ok(Box::new(ViewRays::start(self, request)))
    }

    fn emit<'a>(
        &'a self,
        lanes: usize,
        numbers: &[f32],
        rules: PathRules,
    ) -> SceneResult<Box<dyn PhotonWalk + 'a>> {
        Ok(Box::new(Photons::emit(self, lanes, numbers, rules.limits)))
    }

    fn extinction(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(points, |fog| fog.sigma_t, out);
        Ok(())
    }

    fn scattering(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(points, |fog| fog.sigma_t * fog.albedo, out);
        Ok(())
    }

    fn eval_phase(&self, pairs: &PhasePairs, out: &mut Planes) -> SceneResult<()> {
        out.resize(pairs.medium.len());
        for (lane, &medium) in pairs.medium.iter().enumerate() {
            // Of unit length in f64: narrow lobes see the rounding of an f32.
            let travel = pairs.photon_direction.get(lane).as_dvec3().normalize();
            let cosine = -travel.dot(pairs.view_direction.get(lane).as_dvec3().normalize());
            let value = self.fog(medium).map_or(0.0, |fog| phase::eval(fog.phase, cosine));
            out.set_rgb(lane, Rgb::splat(value as f32));
        }
        Ok(())
    }

    fn store_points(&self, points: &PointSegments) -> SceneResult<()> {
        let stored = (0..points.origin.lanes()).map(|lane| {
            let origin = points.origin.get(lane).as_dvec3();
            let direction = points.direction.get(lane).as_dvec3();
            self.point_at(
                &Ray { origin, direction, medium: VACUUM },
                points.skips_emitters[lane] != 0,
            )
        });
        *self.points.write().expect("no writer panics") = stored.collect();
        Ok(())
    }

    fn eval_bsdf(&self, pairs: &SurfacePairs, out: &mut Planes) -> SceneResult<()> {
        let points = self.points.read().expect("no writer panics");
        out.resize(pairs.point.len());
        for (lane, &index) in pairs.point.iter().enumerate() {
            let point = points[index as usize];
            let travel = pairs.photon_direction.get(lane).as_dvec3();
            let same_side = travel.dot(point.normal) < 0.0;
            let value = if same_side { point.reflectance * (1.0 / PI) as f32 } else { Rgb::ZERO };
            out.set_rgb(lane, value);
        }
        Ok(())
    }

    fn lamp_light(&self, places: &Places, numbers: &[f32], out: &mut LampLight) -> SceneResult<()> {
        lamp_light::lamp_light(self, places, numbers, out);
        Ok(())
    }
}
