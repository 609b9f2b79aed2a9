// What lamps emit at wavelengths that are given. Mitsuba's `sample_ray` draws wavelengths of its own; where a walk starts and
// whereto does not hang on them, so its ray is kept, and what the walk carries is told anew. [Emission at wavelengths]
#pragma once

#include "named_parts.h"

#include <mitsuba/render/texture.h>

#include <vector>

namespace vpt {

template <typename Float, typename Spectrum> class Emission {
public:
    MI_IMPORT_TYPES(Scene, Emitter, EmitterPtr, Texture)
    static constexpr bool Jit = dr::is_jit_v<Float>;

    // Refuses lamps that are not Mitsuba's own: the density of their rays is not known.
    Emission(const Scene *scene, const std::vector<Emitter *> &lamps) : m_lamps(lamps) {
        auto radius = scene->bbox().valid() ? scene->bbox().bounding_sphere().radius : 0.f;
        // As lamps that are infinitely far away have it.
        radius = std::max(math::RayEpsilon<float>, radius * (1.f + math::RayEpsilon<float>));
        m_cross_section = dr::Pi<float> * radius * radius;
        std::vector<float> extents;
        for (const Emitter *lamp : lamps)
            extents.push_back(extent(lamp));
        if constexpr (Jit) {
            std::vector<float> by_id(jit_registry_id_bound(Scene::Variant, "Emitter") + 1, 0.f);
            for (size_t i = 0; i < extents.size(); ++i)
                by_id[jit_registry_id(lamps[i])] = extents[i];
            m_extents = dr::load<DynamicBuffer<Float>>(by_id.data(), by_id.size());
            dr::eval(m_extents);
        } else {
            m_extents = dr::load<DynamicBuffer<Float>>(extents.data(), extents.size());
        }
    }

    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro callback) const {
        dr::traverse_1_fn_ro(m_extents, payload, callback);
    }

    // Emission over the density of the ray's place and direction, given the emitter, at the ray's wavelengths and time; `place`
    // are the numbers that chose the place. [W/nm per walk]
    UnpolarizedSpectrum flux(const EmitterPtr &emitter, const Ray3f &ray, const Point2f &place) const {
        UInt32 flags = emitter->flags(true);
        Mask surface = has_flag(flags, EmitterFlags::Surface), parallel = has_flag(flags, EmitterFlags::DeltaDirection),
             sky = has_flag(flags, EmitterFlags::Infinite) && !parallel, delta = !surface && !sky;
        UnpolarizedSpectrum out(0.f);
        if (dr::any_or<true>(surface))
            dr::masked(out, surface) = of_surface(emitter, ray, place, surface, parallel);
        if (dr::any_or<true>(delta))
            dr::masked(out, delta) = of_delta(emitter, ray, delta, parallel);
        if (dr::any_or<true>(sky))
            dr::masked(out, sky) = of_sky(emitter, ray, sky);
        return out;
    }

private:
    // Lambertian lamps, and such that shine along their normals.
    UnpolarizedSpectrum of_surface(const EmitterPtr &emitter, const Ray3f &ray, const Point2f &place, const Mask &active,
                                   const Mask &parallel) const {
        auto [ps, inverse_density] = emitter->sample_position(ray.time, place, active);
        SurfaceInteraction3f si(ps, ray.wavelengths);
        si.wi = Vector3f(0.f, 0.f, 1.f);
        si.time = ray.time;
        UnpolarizedSpectrum radiance = unpolarized_spectrum(emitter->eval(si, active && !parallel));
        for (auto &[lamp, texture] : m_parallel) {
            Mask own = active && emitter == EmitterPtr(lamp);
            dr::masked(radiance, own) = texture->eval(si, own);
        }
        return radiance * inverse_density * dr::select(parallel, 1.f, dr::Pi<Float>);
    }

    // Points, spots and projectors, and parallel light from afar: seen from a place on the ray.
    UnpolarizedSpectrum of_delta(const EmitterPtr &emitter, const Ray3f &ray, const Mask &active, const Mask &parallel) const {
        // As far as coordinates are large, so that rounding does not show.
        Float reach = dr::maximum(1.f, dr::max(dr::abs(ray.o)));
        Interaction3f it = dr::zeros<Interaction3f>();
        it.p = ray.o + ray.d * reach;
        it.time = ray.time;
        it.wavelengths = ray.wavelengths;
        auto [ds, value] = emitter->sample_direction(it, Point2f(.5f), active);
        Float inverse_density = extent_of(emitter, active);
        for (auto &[lamp, texture] : m_projectors) {
            Mask own = active && emitter == EmitterPtr(lamp);
            Float cosine = -dr::dot(ds.n, ds.d);
            dr::masked(inverse_density, own) *= cosine * cosine * cosine / texture->pdf_position(ds.uv, own);
        }
        return unpolarized_spectrum(value) * inverse_density * dr::select(parallel, 1.f, dr::square(reach));
    }

    // Skies start their rays on a disk across them, or, where they are the same everywhere, as densely from a sphere.
    UnpolarizedSpectrum of_sky(const EmitterPtr &emitter, const Ray3f &ray, const Mask &active) const {
        SurfaceInteraction3f si = dr::zeros<SurfaceInteraction3f>();
        si.wi = ray.d;
        si.time = ray.time;
        si.wavelengths = ray.wavelengths;
        DirectionSample3f ds = dr::zeros<DirectionSample3f>();
        ds.d = -ray.d;
        ds.time = ray.time;
        Float density = emitter->pdf_direction(si, ds, active);
        UnpolarizedSpectrum radiance = unpolarized_spectrum(emitter->eval(si, active));
        return dr::select(density > 0.f, radiance * (m_cross_section / density), 0.f);
    }

    Float extent_of(const EmitterPtr &emitter, const Mask &active) const {
        if constexpr (Jit) {
            return dr::gather<Float>(m_extents, dr::reinterpret_array<UInt32>(emitter), active);
        } else {
            DRJIT_MARK_USED(active);
            for (size_t i = 0; i < m_lamps.size(); ++i)
                if (m_lamps[i] == emitter)
                    return m_extents[i];
            return 0.f;
        }
    }

    // The solid angle [sr] into which lamps without size shine alike, the area [m²] that parallel light crosses, or that of a
    // projector's picture at distance 1.
    float extent(const Emitter *emitter) {
        std::string kind(emitter->class_name());
        NamedParts parts(const_cast<Emitter *>(emitter));
        if (kind == "PointLight")
            return 4.f * dr::Pi<float>;
        if (kind == "SpotLight") {
            float angle = plain(*parts.template value<Float>("cutoff_angle"));
            return 2.f * dr::Pi<float> * (1.f - std::cos(dr::deg_to_rad(angle)));
        }
        if (kind == "DirectionalEmitter")
            return m_cross_section;
        if (kind == "Projector") {
            m_projectors.emplace_back(emitter, texture(parts, "irradiance"));
            return picture_area(emitter);
        }
        if (kind == "DirectionalArea")
            m_parallel.emplace_back(emitter, texture(parts, "radiance"));
        for (const char *known : { "AreaLight", "DirectionalArea", "ConstantBackgroundEmitter", "EnvironmentMapEmitter",
                                   "SunskyEmitter", "TimedSunskyEmitter" })
            if (kind == known)
                return 1.f;
        Throw("vpt: the lamp \"%s\" (%s) is none of Mitsuba's own, and what it emits at a given wavelength is not known; use one "
              "of those, or a variant in RGB", emitter->id(), kind);
    }

    static const Texture *texture(const NamedParts &parts, const char *name) {
        return dynamic_cast<const Texture *>(parts.object(name));
    }

    // By where on its picture two places lie.
    static float picture_area(const Emitter *projector) {
        auto uv = [&](float x, float y) {
            Interaction3f it = dr::zeros<Interaction3f>();
            it.p = projector->world_transform() * Point3f(x, y, 1.f);
            return projector->sample_direction(it, Point2f(.5f), true).first.uv;
        };
        Point2f step = uv(1.f, 1.f) - uv(0.f, 0.f);
        return 1.f / std::abs(plain(Float(step.x() * step.y())));
    }

    std::vector<Emitter *> m_lamps;
    float m_cross_section = 0.f;
    DynamicBuffer<Float> m_extents;
    // Lamps that do not tell by themselves what they emit, with what does.
    std::vector<std::pair<const Emitter *, const Texture *>> m_parallel, m_projectors;
};

}
