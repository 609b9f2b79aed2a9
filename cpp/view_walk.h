// View rays: from the sensor through delta lobes and medium boundaries, one segment a step.
#pragma once

#include "glossy.h"
#include "slots.h"
#include "survivors.h"
#include "tables.h"

namespace vpt {

template <typename Float, typename Spectrum> class ViewWalk {
public:
    MI_IMPORT_TYPES(Scene, Sensor, Film, Medium, MediumPtr, Emitter, EmitterPtr, BSDF, BSDFPtr, Shape,
                    ShapePtr)
    using Tables = SceneTables<Float, Spectrum>;
    using Channels = Band<Float, Spectrum>;

    struct Ray {
        Ray3f ray;
        MediumPtr medium;
        // Density with which the last sharp direction was sampled; infinite before.
        Float sharpness;
        // Number within the batch.
        UInt32 depth, index;
        Mask active;
        DRJIT_STRUCT(Ray, ray, medium, sharpness, depth, index, active)
    };

    ViewWalk(const Scene *scene, const Sensor *sensor, const Tables &tables, const Channels &band,
             const VptViewRequest &request)
        : m_scene(scene), m_tables(tables), m_band(band), m_rules(request.rules), m_lanes(request.lanes),
          m_rays(element_count<Float>(request.lanes)) {
        size_t n = m_lanes, kept = 0;
        Planes asked{ {}, {}, { request.importance } };
        Writer<Float> out(n, asked);
        for (size_t e = 0; e < m_rays.size(); ++e) {
            StartNumbers u = start_numbers(request, e);
            Ray &ray = m_rays[e];
            tables.run({ "view start", &m_rules, &asked }, dr::tie(u, m_band), dr::tie(ray, out), [&] {
                out.put3(request.importance, e, Channels::channels(start(sensor, u, ray, e)));
            });
            keep<Float>(m_rays, e, kept);
        }
        m_lanes = drop_finished<Float>(m_rays, n, kept);
        out.flush();
    }

    uint32_t lanes() const { return m_lanes; }

    void step(uint32_t steps, const float *numbers, const VptViewVertices &out) {
        size_t n = m_lanes;
        if (m_rays.empty())
            return;
        if (steps > 1) {
            take_steps(steps, numbers, out);
            return;
        }
        Planes asked = planes(out);
        Writer<Float> writer(n, asked);
        size_t kept = 0;
        for (size_t e = 0; e < m_rays.size(); ++e) {
            Float lobe = read<Float>(numbers, n, e);
            Point2f direction(read<Float>(numbers + n, n, e), read<Float>(numbers + 2 * n, n, e));
            if constexpr (dr::is_jit_v<Float>) {
                Ray ray;
                m_tables.run({ "view step", &m_rules, &asked }, dr::tie(m_rays[e], lobe, direction), dr::tie(ray, writer), [&] {
                    ray = m_rays[e];
                    step(ray, lobe, direction, out, writer, e);
                });
                m_rays[e] = ray;
            } else {
                step(m_rays[e], lobe, direction, out, writer, e);
            }
            keep<Float>(m_rays, e, kept);
        }
        m_lanes = drop_finished<Float>(m_rays, n, kept);
        writer.flush();
    }

    // The first surface, emitters skipped where `hide_emitters` asks for it.
    static SurfaceInteraction3f intersect(const Scene *scene, const Ray3f &ray_, const Mask &skips_emitters,
                                          const Mask &active) {
        SurfaceInteraction3f si = scene->ray_intersect(ray_, active);
        if (dr::none_or<false>(skips_emitters && active))
            return si;
        struct State {
            SurfaceInteraction3f si;
            Ray3f ray;
            Mask active;
            DRJIT_STRUCT(State, si, ray, active)
        } state{ si, ray_, active && skips_emitters };
        dr::tie(state) = dr::while_loop(
            dr::make_tuple(state), [](const State &s) { return s.active; },
            [scene](State &s) {
                s.active &= s.si.is_valid();
                if (dr::any_or<true>(s.active))
                    s.active &= s.si.shape->emitter() != nullptr;
                dr::masked(s.ray, s.active) = s.si.spawn_ray(s.ray.d);
                if (dr::any_or<true>(s.active))
                    dr::masked(s.si, s.active) = scene->ray_intersect(s.ray, s.active);
            },
            "Skip emitters");
        si = state.si;
        dr::masked(si.t, si.is_valid()) = dr::norm(si.p - ray_.o);
        return si;
    }

private:
    // Several steps in one kernel: a loop, whose vertices go to slots.
    void take_steps(uint32_t steps, const float *numbers, const VptViewVertices &out) {
        if constexpr (dr::is_jit_v<Float>) {
            size_t n = m_lanes;
            // Opaque, so that Dr.Jit does not compile a kernel for each number of lanes and steps.
            UInt32 lanes = dr::opaque<UInt32>((uint32_t) n), end = dr::opaque<UInt32>(steps), lane = dr::arange<UInt32>(n);
            Float all = dr::load<Float>(numbers, (size_t) steps * 3 * n);
            Planes asked = planes(out);
            Slots<Float> slots((size_t) steps * n, VPT_VIEW_ABSENT, asked);
            Ray ray;
            m_tables.run({ "view steps", &m_rules, &asked }, dr::tie(m_rays[0], lanes, end, all, slots), dr::tie(ray, slots),
                         [&] { ray = walk_on(m_rays[0], lane, lanes, end, all, out, slots); });
            m_rays[0] = ray;
            m_lanes = drop_finished<Float>(m_rays, n, 1);
            slots.flush();
        } else {
            DRJIT_MARK_USED(numbers);
            DRJIT_MARK_USED(out);
            Throw("a scalar variant takes one step a call, not %u", steps);
        }
    }

    // Until `end` steps are done or nothing is left.
    Ray walk_on(const Ray &start, const UInt32 &lane, const UInt32 &lanes, const UInt32 &end, const Float &numbers,
                const VptViewVertices &out, Slots<Float> &slots) const {
        Ray ray = start;
        UInt32 done = dr::zeros<UInt32>(dr::width(lane));
        dr::tie(ray, done) = dr::while_loop(
            dr::make_tuple(ray, done), [end](const Ray &r, const UInt32 &done) { return r.active && done < end; },
            [&](Ray &r, UInt32 &done) {
                auto number = [&](uint32_t i) {
                    return dr::gather<Float>(numbers, (done * 3u + i) * lanes + lane, r.active);
                };
                slots.select(done * lanes + lane, r.active);
                step(r, number(0), Point2f(number(1), number(2)), out, slots, 0);
                done += 1u;
            },
            "View rays");
        slots.finish();
        return ray;
    }

    static Planes planes(const VptViewVertices &out) {
        return { { out.ray, out.flags, out.medium },
                 { out.length },
                 { out.origin, out.direction, out.position, out.normal, out.geometric_normal, out.reflectance, out.emission,
                   out.weight } };
    }

    // What chooses where and how a ray starts.
    struct StartNumbers {
        Vector2f position;
        Point2f aperture;
        Float time, wavelength;
        DRJIT_STRUCT(StartNumbers, position, aperture, time, wavelength)
    };

    StartNumbers start_numbers(const VptViewRequest &request, size_t e) const {
        size_t n = m_lanes;
        auto plane = [&](const float *planes, size_t i) { return read<Float>(planes + i * n, n, e); };
        return { Vector2f(plane(request.film, 0), plane(request.film, 1)),
                 Point2f(plane(request.numbers, 0), plane(request.numbers, 1)), plane(request.numbers, 2),
                 plane(request.numbers, 3) };
    }

    UnpolarizedSpectrum start(const Sensor *sensor, const StartNumbers &u, Ray &ray, size_t e) const {
        const Film *film = sensor->film();
        ScalarVector2f scale = 1.f / ScalarVector2f(film->crop_size()),
                       offset = -ScalarVector2f(film->crop_offset()) * scale;
        Float time = sensor->shutter_open() + u.time * sensor->shutter_open_time();
        Float wavelength = Channels::Spectral ? m_band.number() : u.wavelength;
        auto [differential, weight] = sensor->sample_ray_differential(
            time, wavelength, dr::fmadd(u.position, scale, offset), u.aperture);
        ray.ray = Ray3f(differential);
        ray.ray.wavelengths = m_band.wavelengths(m_lanes);
        ray.medium = sensor->medium();
        ray.sharpness = dr::Infinity<Float>;
        ray.depth = dr::zeros<UInt32>(m_lanes);
        if constexpr (dr::is_jit_v<Float>)
            ray.index = dr::arange<UInt32>(m_lanes);
        else
            ray.index = (uint32_t) e;
        ray.active = m_rules.max_depth > 0;
        return m_band.importance(unpolarized_spectrum(weight));
    }

    bool simulates(uint32_t effect) const { return (m_rules.effects & effect) != 0; }

    template <typename Out>
    void step(Ray &s, const Float &lobe, const Point2f &direction, const VptViewVertices &out, Out &writer,
              size_t e) const {
        Mask first = s.depth == 0u, hides = first && m_rules.hide_emitters != 0;
        SurfaceInteraction3f si = m_rules.hide_emitters ? intersect(m_scene, s.ray, hides, s.active)
                                                         : m_scene->ray_intersect(s.ray, s.active);
        Mask hit = s.active && si.is_valid();

        Mask emits = false;
        Spectrum emission = dr::zeros<Spectrum>();
        if (simulates(VPT_EFFECT_DIRECT_EMISSION)) {
            Mask looked_at = simulates(VPT_EFFECT_ENVIRONMENT) ? s.active : hit;
            EmitterPtr emitter = si.emitter(m_scene, looked_at);
            emits = looked_at && emitter != nullptr && !hides;
            // Of a lamp that is sharper still visible points see the light.
            if (m_rules.glossy_chains)
                emits &= s.sharpness > m_tables.lamp_density(emitter, s.ray.d, si.t, emits);
            if (dr::any_or<true>(emits))
                dr::masked(emission, emits) = emitter->eval(si, emits);
        }

        Surface surface;
        UnpolarizedSpectrum weight = 0.f;
        Mask scattered = false, continues = false;
        UInt32 medium(VPT_VACUUM);
        if (simulates(VPT_EFFECT_MEDIUM_SAMPLING))
            medium = dr::select(s.active, m_tables.medium_index(s.medium), medium);
        writer.put(out.ray, e, s.index);
        writer.put(out.medium, e, medium);
        writer.put3(out.origin, e, s.ray.o);
        writer.put3(out.direction, e, s.ray.d);
        if (dr::any_or<true>(hit)) {
            BSDFPtr bsdf = si.bsdf(s.ray);
            surface = look_at(s, si, bsdf, hit);
            if (simulates(VPT_EFFECT_SPECULAR_CHAINS))
                std::tie(weight, scattered, continues) = follow(s, si, bsdf, surface.lobes, lobe, direction, hit);
        }
        s.active = continues;

        auto bit = [](const Mask &mask, uint32_t value) { return dr::select(mask, UInt32(value), UInt32(0)); };
        writer.put(out.flags, e, bit(continues, VPT_VIEW_CONTINUES) | bit(surface.visible_point, VPT_VIEW_VISIBLE_POINT) |
                                     bit(surface.lambertian, VPT_VIEW_LAMBERTIAN) | bit(emits, VPT_VIEW_EMISSION) |
                                     bit(hit, VPT_VIEW_HIT) | bit(scattered, VPT_VIEW_SCATTERED));
        Float side = dr::sign(Frame3f::cos_theta(si.wi));
        writer.put(out.length, e, dr::select(hit, si.t, dr::Infinity<Float>));
        writer.put3(out.position, e, si.p);
        writer.put3(out.normal, e, Vector3f(si.sh_frame.n * side));
        writer.put3(out.geometric_normal, e, Vector3f(si.n));
        writer.put3(out.reflectance, e, Channels::channels(surface.reflectance));
        writer.put3(out.emission, e, Channels::channels(unpolarized_spectrum(emission)));
        writer.put3(out.weight, e, Channels::channels(weight));
    }

    // What is seen of a surface besides its delta lobes.
    struct Surface {
        UInt32 lobes = 0u;
        Mask visible_point = false, lambertian = false;
        UnpolarizedSpectrum reflectance = 0.f;
    };

    Surface look_at(const Ray &s, const SurfaceInteraction3f &si, const BSDFPtr &bsdf, const Mask &hit) const {
        Surface out;
        out.lobes = dr::select(hit, bsdf->flags(), 0u);
        if (!simulates(VPT_EFFECT_SURFACE_GATHERING))
            return out;
        // The back of a one-sided BSDF is black, whatever `eval_diffuse_reflectance` says of it.
        Mask reflects = Frame3f::cos_theta(si.wi) > 0.f || has_flag(out.lobes, BSDFFlags::BackSide);
        out.visible_point =
            hit && reflects && has_flag(out.lobes, BSDFFlags::Smooth) && s.depth + 1u < m_rules.max_depth;
        out.lambertian = out.visible_point && m_tables.is_lambertian(bsdf, out.visible_point);
        if (dr::any_or<true>(out.lambertian))
            out.reflectance = unpolarized_spectrum(bsdf->eval_diffuse_reflectance(si, out.lambertian)) & out.lambertian;
        return out;
    }

    // Continues by a delta lobe or in a sharp direction; all else of smooth lobes ends here as a visible point.
    std::tuple<UnpolarizedSpectrum, Mask, Mask>
    follow(Ray &s, SurfaceInteraction3f &si, const BSDFPtr &bsdf, const UInt32 &lobes, const Float &lobe,
                 const Point2f &direction, const Mask &hit) const {
        Mask delta = hit && has_flag(lobes, BSDFFlags::Delta), glossy = false;
        if (m_rules.glossy_chains)
            glossy = hit && !delta && has_flag(lobes, BSDFFlags::Glossy);
        if (dr::none_or<false>(delta || glossy))
            return { UnpolarizedSpectrum(0.f), false, false };
        BSDFContext context(TransportMode::Radiance, (uint32_t) BSDFFlags::Delta);
        auto [bs, value] = bsdf->sample(context, si, lobe, direction, delta);
        Mask active = delta && has_flag(bs.sampled_type, BSDFFlags::Delta);
        if (m_rules.glossy_chains && dr::any_or<true>(glossy)) {
            BSDFContext any(TransportMode::Radiance);
            auto [glossy_bs, glossy_value] = bsdf->sample(any, si, lobe, direction, glossy);
            Float density = bsdf->pdf(any, si, glossy_bs.wo, glossy);
            Mask sharp = glossy && is_sharp(lobes, density, Float(0.f));
            dr::masked(s.sharpness, sharp) = density;
            dr::masked(bs, sharp) = glossy_bs;
            dr::masked(value, sharp) = glossy_value;
            active |= sharp;
        }
        UnpolarizedSpectrum weight = unpolarized_spectrum(value) & active;
        active &= dr::any(weight != 0.f);
        Mask scattered = active && !has_flag(bs.sampled_type, BSDFFlags::Null);

        Ray3f next = si.spawn_ray(si.to_world(bs.wo));
        dr::masked(s.ray, active) = next;
        Mask transition = active && si.is_medium_transition();
        if (simulates(VPT_EFFECT_MEDIUM_SAMPLING) && dr::any_or<true>(transition))
            dr::masked(s.medium, transition) = si.target_medium(next.d);
        dr::masked(s.depth, scattered) += 1u;
        active &= s.depth < m_rules.max_depth;
        return { weight, scattered, active };
    }

    const Scene *m_scene;
    const Tables &m_tables;
    const Channels &m_band;
    VptRules m_rules;
    uint32_t m_lanes;
    std::vector<Ray> m_rays;
};

}
