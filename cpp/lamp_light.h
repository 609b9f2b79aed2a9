// Light straight from lamps: what a place gets of it through null boundaries and media.
#pragma once

#include "tables.h"

namespace vpt {

template <typename Float, typename Spectrum> class LampLight {
public:
    MI_IMPORT_TYPES(Scene, Sensor, MediumPtr, BSDFPtr, EmitterPtr, ShapePtr)
    using Tables = SceneTables<Float, Spectrum>;
    using Channels = Band<Float, Spectrum>;

    struct Sample {
        Vector3f direction;
        UnpolarizedSpectrum irradiance;
        EmitterPtr emitter;
        // From the lamp to what its light meets first.
        Float distance;
        Mask lit;
    };

    LampLight(const Scene *scene, const Sensor *sensor, const Tables &tables, const Channels &band)
        : m_scene(scene), m_sensor(sensor), m_tables(tables), m_band(band) {}

    // `normal` is 0 within a medium; `medium` is crossed first.
    Sample sample(const Point3f &position, const Normal3f &normal, const MediumPtr &medium, const Point2f &lamp,
                  const UInt32 &seed) const {
        Interaction3f place = dr::zeros<Interaction3f>(dr::width(position));
        place.p = position;
        place.n = normal;
        place.time = m_sensor->shutter_open();
        place.wavelengths = m_band.wavelengths(dr::width(position));
        auto [emitter, inverse_probability, again] = m_tables.lamps().choose(lamp.x(), true);
        auto [ds, value] = emitter->sample_direction(place, Point2f(again, lamp.y()), true);
        value *= inverse_probability;
        Mask lit = ds.pdf > 0.f && m_tables.emitter_medium(ds.emitter, true).second;
        Mask far = has_flag(dr::select(lit, ds.emitter->flags(lit), 0u), EmitterFlags::Infinite);
        Way way{ place.spawn_ray_to(ds.p), ds.p, far, medium, dr::zeros<SurfaceInteraction3f>(dr::width(position)),
                 UnpolarizedSpectrum(1.f), ds.dist, 0u, lit, true };
        go(way, seed);
        UnpolarizedSpectrum irradiance = dr::select(lit, unpolarized_spectrum(value) * way.passed, 0.f);
        // Mitsuba's density for a lamp of less than some 3e-4 of its distance is infinite: let that be seen and counted.
        dr::masked(irradiance, lit && !dr::isfinite(ds.pdf)) = dr::NaN<Float>;
        return { dr::select(lit, -ds.d, Vector3f(0.f)), irradiance, ds.emitter, way.distance, lit };
    }

private:
    // What is left of the light so far would not be seen.
    static constexpr float Opaque = 1e-9f;

    struct Way {
        Ray3f ray;
        Point3f lamp;
        Mask far;
        MediumPtr medium;
        SurfaceInteraction3f si;
        UnpolarizedSpectrum passed;
        Float distance;
        UInt32 event;
        Mask active, looks;
        DRJIT_STRUCT(Way, ray, lamp, far, medium, si, passed, distance, event, active, looks)
    };

    void go(Way &way, const UInt32 &seed) const {
        dr::tie(way) = dr::while_loop(
            dr::make_tuple(way), [](const Way &w) { return w.active; }, [this, seed](Way &w) { step(w, seed); },
            "Lamp light");
    }

    // To the next null collision, boundary, or the lamp.
    void step(Way &w, const UInt32 &seed) const {
        Mask looks = w.active && w.looks;
        dr::masked(w.ray.maxt, w.active) = dr::select(w.far, dr::Largest<Float>, left(w));
        if (dr::any_or<true>(looks))
            dr::masked(w.si, looks) = m_scene->ray_intersect(w.ray, looks);
        Mask hit = w.active && w.si.is_valid();
        Float end = dr::select(hit, w.si.t, dr::select(w.far, dr::Infinity<Float>, w.ray.maxt));
        Mask collided = false, inside = w.active && w.medium != nullptr;
        if (dr::any_or<true>(inside))
            collided = attenuate(w, end, inside, seed);
        w.looks = !collided;
        hit &= !collided;
        if (dr::any_or<true>(hit))
            cross(w, hit);
        w.active &= (hit || collided) && dr::max(w.passed) > Opaque;
    }

    static Float left(const Way &w) { return dr::norm(w.lamp - w.ray.o) * (1.f - math::ShadowEpsilon<Float>); }

    // Homogeneous media have a formula; others take a step of ratio tracking. Says where a null collision comes before `end`.
    Mask attenuate(Way &w, const Float &end, const Mask &inside, const UInt32 &seed) const {
        Float number = sample_tea_float32<UInt32>(seed, w.event);
        MediumInteraction3f mei = w.medium->sample_interaction(w.ray, number, 0u, inside);
        Mask constant = inside && w.medium->is_homogeneous(),
             collided = inside && !constant && mei.is_valid() && mei.t < end;
        UnpolarizedSpectrum majorant = mei.combined_extinction;
        dr::masked(w.passed, constant) *= dr::select(majorant == 0.f, 1.f, dr::exp(-majorant * end));
        // Nothing is taken away where a grid is negative.
        dr::masked(w.passed, collided) *= 1.f - dr::maximum(mei.sigma_t, 0.f) * dr::rcp(majorant);
        dr::masked(w.ray.o, collided) = mei.p;
        dr::masked(w.si.t, collided) = w.si.t - mei.t;
        w.event += 1u;
        return collided;
    }

    // Through the null lobe of a surface.
    static void cross(Way &w, const Mask &hit) {
        BSDFPtr bsdf = w.si.bsdf();
        dr::masked(bsdf, !hit) = nullptr;
        dr::masked(w.passed, hit) *= unpolarized_spectrum(bsdf->eval_null_transmission(w.si, hit));
        Mask transition = hit && w.si.is_medium_transition();
        if (dr::any_or<true>(transition))
            dr::masked(w.medium, transition) = w.si.target_medium(w.ray.d);
        Ray3f next = w.si.spawn_ray(w.ray.d);
        dr::masked(w.ray, hit) = next;
        dr::masked(w.distance, hit) = dr::norm(w.lamp - next.o);
        // The lamp lay behind by less than the step off the surface.
        w.active &= !hit || w.far || dr::dot(w.lamp - w.ray.o, w.ray.d) > 0.f;
    }

    const Scene *m_scene;
    const Sensor *m_sensor;
    const Tables &m_tables;
    const Channels &m_band;
};

}
