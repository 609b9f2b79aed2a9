// The yardstick of the seam: the same photon walks as `PhotonWalk`, one at a time, in a plain loop of
// Mitsuba calls with Mitsuba's own random numbers, no batches and no outputs. Right for grey media and for surfaces
// without shading normals.
#pragma once

#include "roulette.h"
#include "tables.h"

namespace vpt {

// Returns the number of path vertices. Scalar variants only.
template <typename Float, typename Spectrum>
uint64_t bare_walks(const Scene<Float, Spectrum> *scene, const SceneTables<Float, Spectrum> &tables,
                    uint64_t walks, uint32_t max_depth, uint32_t rr_depth) {
    MI_IMPORT_TYPES(BSDFPtr, PhaseFunctionContext)
    using Channels = Band<Float, Spectrum>;
    static_assert(!dr::is_jit_v<Float>);
    PCG32<uint32_t> rng;
    auto next = [&rng] { return rng.template next_float<float>(); };
    PhaseFunctionContext phase_context(nullptr);
    BSDFContext bsdf_context(TransportMode::Importance);
    uint64_t vertices = 0;
    for (uint64_t i = 0; i < walks; ++i) {
        auto [ray, weight, emitter] =
            scene->sample_emitter_ray(0.f, next(), Point2f(next(), next()), Point2f(next(), next()), true);
        auto [medium, shines] = tables.emitter_medium(emitter, true);
        auto flux = unpolarized_spectrum(weight);
        float emitted = dr::max(flux);
        uint32_t channel = std::min((uint32_t) (next() * 3.f), 2u);
        bool alive = shines && emitted > 0.f;
        for (uint32_t depth = 0; alive && depth < max_depth - 1u;) {
            SurfaceInteraction3f si = scene->ray_intersect(ray, true);
            MediumInteraction3f mei;
            bool collided = false;
            float remaining = si.t;
            while (medium && !collided) {
                mei = medium->sample_interaction(ray, next(), channel, true);
                if (!mei.is_valid() || mei.t >= remaining)
                    break;
                float majorant = Channels::of_hero(mei.combined_extinction, channel);
                collided = next() * majorant < Channels::of_hero(mei.sigma_t, channel);
                ray.o = mei.p;
                remaining -= mei.t;
            }
            ++vertices;
            if (collided) {
                flux *= mei.sigma_s / mei.sigma_t;
                auto [wo, value, pdf] = medium->phase_function()->sample(phase_context, mei, next(),
                                                                         Point2f(next(), next()), true);
                ray = mei.spawn_ray(wo);
                flux *= unpolarized_spectrum(value);
                ++depth;
            } else if (si.is_valid()) {
                BSDFPtr bsdf = si.bsdf();
                auto [bs, value] = bsdf->sample(bsdf_context, si, next(), Point2f(next(), next()), true);
                ray = si.spawn_ray(si.to_world(bs.wo));
                flux *= unpolarized_spectrum(value);
                if (si.is_medium_transition())
                    medium = si.target_medium(ray.d);
                depth += has_flag(bs.sampled_type, BSDFFlags::Null) ? 0 : 1;
            } else {
                break;
            }
            float q = survival(float(dr::max(flux) / emitted), depth);
            alive = q > 0.f && (depth <= rr_depth || next() < q);
            if (depth > rr_depth)
                flux /= q;
        }
    }
    return vertices;
}

}
