// Photon walks: from an emitter through surfaces and media, one segment a step.
#pragma once

#include "roulette.h"
#include "slots.h"
#include "survivors.h"
#include "tables.h"

namespace vpt {

template <typename Float, typename Spectrum> class PhotonWalk {
public:
    MI_IMPORT_TYPES(Scene, Sensor, Medium, MediumPtr, EmitterPtr, BSDF, BSDFPtr, PhaseFunctionContext,
                    ShapePtr)
    using Tables = SceneTables<Float, Spectrum>;
    using Channels = Band<Float, Spectrum>;
    static constexpr bool Jit = dr::is_jit_v<Float>;

    // `flux` carries spectral multiple importance sampling over the hero channel: it is divided by the
    // mean of `density`, the density of this walk had another channel been the hero, relative to this
    // one's; both are rescaled so that the mean stays 1. Where channels are wavelengths, the hero's lane is the first.
    struct Walk {
        Ray3f ray;
        MediumPtr medium;
        UnpolarizedSpectrum flux, density;
        // How densely the lamp's light lies in directions; below 0 what that is at a distance of 1, until it is known how far
        // it gets.
        Float emitted, lamp_density;
        UInt32 channel, depth, index, seed, steps;
        // Whether connections find the emitter, and whether the walk goes on.
        Mask found, active;
        DRJIT_STRUCT(Walk, ray, medium, flux, density, emitted, lamp_density, channel, depth, index, seed, steps, found, active)
    };

    struct Numbers {
        Float flight, lobe;
        Point2f direction;
        Float roulette;
        DRJIT_STRUCT(Numbers, flight, lobe, direction, roulette)
    };

    PhotonWalk(const Scene *scene, const Sensor *sensor, const Tables &tables, const Channels &band, uint32_t lanes,
               const float *numbers, const VptRules &rules)
        : m_scene(scene), m_tables(tables), m_band(band), m_rules(rules), m_walks(element_count<Float>(lanes)) {
        size_t kept = 0;
        for (size_t e = 0; e < m_walks.size(); ++e) {
            auto number = [&](size_t i) { return read<Float>(numbers + i * lanes, lanes, e); };
            EmissionNumbers u{ number(0), Point2f(number(1), number(2)), Point2f(number(3), number(4)),
                               number(5), number(6), number(7) };
            Walk &walk = m_walks[e];
            tables.run({ "emission", &m_rules }, dr::tie(u, m_band), dr::tie(walk), [&] { emit(sensor, u, lanes, walk, e); });
            // Opaque, so that Dr.Jit does not compile a kernel for each number of steps.
            walk.steps = dr::opaque<UInt32>(0u, lanes);
            keep<Float>(m_walks, e, kept);
        }
        m_lanes = drop_finished<Float>(m_walks, lanes, kept);
    }

    uint32_t lanes() const { return m_lanes; }

    // Which walks are alive, as they were numbered when emitted.
    void alive(uint32_t *out) const {
        if constexpr (Jit) {
            if (m_lanes == 0)
                return;
            UInt32 index = m_walks[0].index;
            dr::eval(index);
            jit_memcpy(dr::backend_v<Float>, out, index.data(), m_lanes * sizeof(uint32_t));
        } else {
            for (size_t i = 0; i < m_walks.size(); ++i)
                out[i] = m_walks[i].index;
        }
    }

    void step(uint32_t steps, const float *numbers, const VptPhotonVertices &out) {
        size_t n = m_lanes;
        if (m_walks.empty())
            return;
        if (steps > 1) {
            take_steps(steps, numbers, out);
            return;
        }
        Planes asked = planes(out);
        Writer<Float> writer(n, asked);
        size_t kept = 0;
        for (size_t e = 0; e < m_walks.size(); ++e) {
            Numbers u{ read<Float>(numbers, n, e), read<Float>(numbers + n, n, e),
                       Point2f(read<Float>(numbers + 2 * n, n, e), read<Float>(numbers + 3 * n, n, e)),
                       read<Float>(numbers + 4 * n, n, e) };
            if constexpr (Jit) {
                Walk walk;
                m_tables.run({ "photon step", &m_rules, &asked }, dr::tie(m_walks[e], u), dr::tie(walk, writer), [&] {
                    walk = m_walks[e];
                    step(walk, u, out, writer, e);
                });
                m_walks[e] = walk;
            } else {
                step(m_walks[e], u, out, writer, e);
            }
            keep<Float>(m_walks, e, kept);
        }
        m_lanes = drop_finished<Float>(m_walks, n, kept);
        writer.flush();
    }

private:
    struct Flight {
        MediumInteraction3f mei;
        Ray3f ray;
        Float remaining;
        UnpolarizedSpectrum flux, density;
        UInt32 event;
        Float sample;
        Mask active, collided;
        DRJIT_STRUCT(Flight, mei, ray, remaining, flux, density, event, sample, active, collided)
    };

    // What chooses where and how a walk starts.
    struct EmissionNumbers {
        Float lamp;
        Point2f place, direction;
        Float time, hero, seed;
        DRJIT_STRUCT(EmissionNumbers, lamp, place, direction, time, hero, seed)
    };

    static Planes planes(const VptPhotonVertices &out) {
        return { { out.walk, out.event, out.medium, out.depth },
                 { out.length, out.lamp_density, out.segment_reach },
                 { out.position, out.direction, out.geometric_normal, out.flux, out.segment_origin, out.segment_flux,
                   out.segment_density } };
    }

    bool simulates(uint32_t effect) const { return (m_rules.effects & effect) != 0; }

    // Several steps in one kernel: a loop, whose vertices go to slots.
    void take_steps(uint32_t steps, const float *numbers, const VptPhotonVertices &out) {
        if constexpr (Jit) {
            size_t n = m_lanes;
            // Opaque, so that Dr.Jit does not compile a kernel for each number of lanes and steps.
            UInt32 lanes = dr::opaque<UInt32>((uint32_t) n), end = dr::opaque<UInt32>(steps),
                   lane = dr::arange<UInt32>(n);
            Float all = dr::load<Float>(numbers, (size_t) steps * 5 * n);
            Planes asked = planes(out);
            Slots<Float> slots((size_t) steps * n, VPT_PHOTON_ABSENT, asked);
            Walk walk;
            m_tables.run({ "photon steps", &m_rules, &asked }, dr::tie(m_walks[0], lanes, end, all, slots),
                         dr::tie(walk, slots), [&] { walk = walk_on(m_walks[0], lane, lanes, end, all, out, slots); });
            m_walks[0] = walk;
            m_lanes = drop_finished<Float>(m_walks, n, 1);
            slots.flush();
        } else {
            DRJIT_MARK_USED(numbers);
            DRJIT_MARK_USED(out);
            Throw("a scalar variant takes one step a call, not %u", steps);
        }
    }

    // Until `end` steps are done or nothing is left.
    Walk walk_on(const Walk &start, const UInt32 &lane, const UInt32 &lanes, const UInt32 &end, const Float &numbers,
                 const VptPhotonVertices &out, Slots<Float> &slots) const {
        Walk walk = start;
        UInt32 done = dr::zeros<UInt32>(dr::width(lane));
        dr::tie(walk, done) = dr::while_loop(
            dr::make_tuple(walk, done), [end](const Walk &w, const UInt32 &done) { return w.active && done < end; },
            [&](Walk &w, UInt32 &done) {
                auto number = [&](uint32_t i) {
                    return dr::gather<Float>(numbers, (done * 5u + i) * lanes + lane, w.active);
                };
                Numbers u{ number(0), number(1), Point2f(number(2), number(3)), number(4) };
                slots.select(done * lanes + lane, w.active);
                step(w, u, out, slots, 0);
                done += 1u;
            },
            "Photon walks");
        slots.finish();
        return walk;
    }

    void emit(const Sensor *sensor, const EmissionNumbers &u, size_t n, Walk &walk, size_t e) const {
        Float time = sensor->shutter_open() + u.time * sensor->shutter_open_time();
        auto [emitter, inverse_probability, again] = m_tables.lamps().choose(u.lamp, true);
        auto [ray, weight] = emitter->sample_ray(time, again, u.place, u.direction, true);
        walk.ray = ray;
        walk.channel = dr::minimum(UInt32(u.hero * 3.f), 2u);
        if constexpr (Channels::Spectral) {
            walk.ray.wavelengths = m_band.wavelengths_of(walk.channel);
            walk.flux = m_tables.emission().flux(emitter, walk.ray, u.place) * inverse_probability;
        } else {
            walk.flux = unpolarized_spectrum(weight) * inverse_probability;
        }
        walk.density = UnpolarizedSpectrum(1.f);
        walk.emitted = dr::max(walk.flux);
        walk.lamp_density = 0.f;
        if (m_rules.glossy_chains)
            walk.lamp_density = m_tables.lamp_density_at_first(emitter, -ray.d, true);
        walk.depth = dr::zeros<UInt32>(n);
        walk.seed = UInt32(u.seed * 0x1p24f);
        walk.steps = 0u;
        if constexpr (Jit)
            walk.index = dr::arange<UInt32>(n);
        else
            walk.index = (uint32_t) e;
        // Parallel light from a surface reaches a place from one point alone.
        UInt32 flags = emitter->flags(true);
        walk.found = !(has_flag(flags, EmitterFlags::Surface) && has_flag(flags, EmitterFlags::DeltaDirection));
        auto [medium, shines] = m_tables.emitter_medium(emitter, true);
        walk.medium = medium;
        // A flux that is not a number takes its one step, so that the engine sees and counts it.
        walk.active = shines && !(walk.emitted <= 0.f) && m_rules.max_depth >= 2;
    }

    template <typename Out>
    void step(Walk &w, const Numbers &u, const VptPhotonVertices &out, Out &writer, size_t e) const {
        Vector3f direction = w.ray.d;
        Point3f origin = w.ray.o;
        UInt32 medium(VPT_VACUUM);
        if (simulates(VPT_EFFECT_MEDIUM_SAMPLING))
            medium = m_tables.medium_index(w.medium);
        UInt32 index = w.index, depth = w.depth;

        SurfaceInteraction3f si = m_scene->ray_intersect(w.ray, w.active);
        put_start(w, out, writer, e);
        if (m_rules.glossy_chains)
            w.lamp_density = Tables::lamp_density_from(w.lamp_density, si.t);
        Flight flight = fly(w, si.t, u);
        Mask collided = flight.collided, surface = w.active && !collided && si.is_valid();
        w.flux = flight.flux;
        w.density = flight.density;
        w.steps += 1u;

        BSDFPtr bsdf = nullptr;
        Mask receives = false;
        if (dr::any_or<true>(surface)) {
            bsdf = si.bsdf(); // photons have no differentials
            if (simulates(VPT_EFFECT_SURFACE_GATHERING))
                receives = surface && has_flag(dr::select(surface, bsdf->flags(), 0u), BSDFFlags::Smooth);
        }
        Point3f position = dr::select(collided, flight.mei.p, si.p);
        UnpolarizedSpectrum flux = w.flux;
        if (dr::any_or<true>(receives))
            flux *= dr::select(receives, shading_ratio(si), 1.f);

        UInt32 event = dr::select(collided, UInt32(VPT_PHOTON_MEDIUM),
                                  dr::select(receives, UInt32(VPT_PHOTON_SURFACE), UInt32(VPT_PHOTON_NONE)));
        event |= dr::select(w.found && depth == 0u, UInt32(VPT_PHOTON_STRAIGHT), UInt32(0));
        writer.put(out.walk, e, index);
        writer.put(out.medium, e, medium);
        writer.put(out.depth, e, depth);
        writer.put3(out.position, e, position);
        writer.put3(out.direction, e, direction);
        Float length = dr::select(collided || surface, dr::norm(position - origin), dr::Infinity<Float>);
        writer.put(out.length, e, length);
        if (out.segment_reach) // rounding must not put a collision behind the surface
            writer.put(out.segment_reach, e, dr::select(collided, dr::maximum(si.t, length), length));
        writer.put3(out.geometric_normal, e, Vector3f(si.n));
        writer.put3(out.flux, e, Channels::channels(flux, w.channel));
        if (out.lamp_density)
            writer.put(out.lamp_density, e, w.lamp_density);

        Mask scattered = false, alive = false;
        // Where photons scatter once, those alone go on that nothing scatters.
        bool goes_on = simulates(VPT_EFFECT_MULTIPLE_SCATTERING);
        if (!goes_on && dr::any_or<true>(surface))
            surface &= has_flag(dr::select(surface, bsdf->flags(), 0u), BSDFFlags::Null);
        if (goes_on && dr::any_or<true>(collided))
            scatter_medium(w, flight.mei, u, collided, scattered, alive);
        if (dr::any_or<true>(surface))
            scatter_surface(w, si, bsdf, u, surface, direction, scattered, alive);
        Mask invalid = alive && !dr::all(dr::isfinite(w.flux));
        writer.put(out.event, e, event | dr::select(invalid, UInt32(VPT_PHOTON_INVALID), UInt32(0)));
        finish(w, u, scattered, alive && !invalid);
    }

    // What is known of a segment before its free flight.
    template <typename Out>
    static void put_start(const Walk &w, const VptPhotonVertices &out, Out &writer, size_t e) {
        if (out.segment_origin)
            writer.put3(out.segment_origin, e, w.ray.o);
        if (out.segment_flux)
            writer.put3(out.segment_flux, e, Channels::channels(w.flux, w.channel));
        if (out.segment_density)
            writer.put3(out.segment_density, e, Channels::channels(w.density, w.channel));
    }

    // The numbers of a free flight: the step's own, shifted by hashes of the walk's seed. Over the seed
    // they are uniform and independent of each other and of the step's own (`u.lobe` serves again where
    // the flight ends), and for one seed they are continuous in the step's own, modulo 1.
    struct FlightNumbers {
        Float flight, lobe;
        UInt32 seed, steps;

        // For the distance after as many null collisions.
        Float distance(const UInt32 &event) const { return shifted(flight, 2u * event); }
        // For whether a tentative collision is real.
        Float acceptance(const UInt32 &event) const { return shifted(lobe, 2u * event + 1u); }

    private:
        // Below 1: the sum is below 2, since a hash has 23 bits and so is at most 1 - 2^-23. A seed has 24 bits, and
        // what is hashed differs for the first 2^20 steps and numbers of each.
        Float shifted(const Float &number, const UInt32 &index) const {
            Float sum = number + sample_tea_float32<UInt32>(seed + (steps << 24), index + ((steps >> 8) << 20));
            return dr::select(sum >= 1.f, sum - 1.f, sum);
        }
    };

    // Delta tracking to the next real collision or to the surface.
    Flight fly(const Walk &w, const Float &surface, const Numbers &u) const {
        Flight f;
        f.ray = w.ray;
        f.remaining = surface;
        f.flux = w.flux;
        f.density = w.density;
        f.event = 0u;
        f.sample = u.flight;
        f.active = simulates(VPT_EFFECT_MEDIUM_SAMPLING) && w.active && w.medium != nullptr;
        f.collided = false;
        // A scalar reads its position alone where nothing collides: zeros for all cost as much as a square root.
        if constexpr (Jit)
            f.mei = dr::zeros<MediumInteraction3f>(dr::width(w.flux));
        else
            f.mei.p = Point3f(0.f);
        if (!simulates(VPT_EFFECT_MEDIUM_SAMPLING))
            return f;
        if (dr::none_or<false>(f.active))
            return f;
        FlightNumbers numbers{ u.flight, u.lobe, w.seed, w.steps };
        MediumPtr medium = w.medium;
        UInt32 channel = w.channel;
        bool coloured = simulates(VPT_EFFECT_COLOURED_EXTINCTION);
        if constexpr (Jit) {
            dr::tie(f) = dr::while_loop(
                dr::make_tuple(f), [](const Flight &f) { return f.active; },
                [medium, channel, coloured, numbers](Flight &f) { collide(f, medium, channel, coloured, numbers); },
                "Free flight");
        } else { // without a copy of the state
            while (f.active)
                collide(f, medium, channel, coloured, numbers);
        }
        return f;
    }

    static void collide(Flight &f, const MediumPtr &medium, const UInt32 &channel, bool coloured,
                        const FlightNumbers &numbers) {
        f.mei = medium->sample_interaction(f.ray, f.sample, channel, f.active);
        Mask inside = f.active && f.mei.is_valid() && f.mei.t < f.remaining;
        Float majorant = Channels::of_hero(f.mei.combined_extinction, channel),
              sigma_t = Channels::of_hero(f.mei.sigma_t, channel);
        // Where nothing but matter is met, whatever the number.
        Mask real = inside && sigma_t > 0.f && sigma_t >= majorant, null = inside && !real;
        if (dr::any_or<true>(null))
            real |= null && numbers.acceptance(f.event) * majorant < sigma_t;
        null &= !real;

        if (coloured)
            weigh_channels(f, medium, channel, inside, real, null, majorant, sigma_t);
        else // in every channel alike: the flight's density is its probability
            dr::masked(f.flux, real) *= f.mei.sigma_s * dr::rcp(sigma_t);

        dr::masked(f.ray.o, null) = f.mei.p;
        dr::masked(f.remaining, null) = f.remaining - f.mei.t;
        f.event += 1u;
        if (dr::any_or<true>(null))
            f.sample = numbers.distance(f.event);
        f.collided |= real;
        f.active = null && f.remaining > 0.f;
    }

    // [Miller 2019] one walk, three hypothetical heroes.
    static void weigh_channels(Flight &f, const MediumPtr &medium, const UInt32 &channel, const Mask &inside,
                               const Mask &real, const Mask &null, const Float &majorant, const Float &sigma_t) {
        auto [crosses, near, far] = medium->intersect_aabb(f.ray);
        Float crossing = dr::maximum(dr::minimum(f.remaining, far) - dr::maximum(near, 0.f), 0.f);
        Float t = dr::select(inside, f.mei.t - f.mei.mint, dr::select(crosses, crossing, 0.f));
        UnpolarizedSpectrum excess = f.mei.combined_extinction - majorant;
        UnpolarizedSpectrum ratio = dr::select(excess == 0.f, 1.f, dr::exp(-t * excess)) ;

        UnpolarizedSpectrum sigma_n = dr::maximum(f.mei.combined_extinction - f.mei.sigma_t, 0.f);
        UnpolarizedSpectrum by_null = sigma_n * dr::rcp(Channels::of_hero(sigma_n, channel));
        UnpolarizedSpectrum value = ratio * dr::select(real, f.mei.sigma_s * dr::rcp(sigma_t), 1.f),
                            density = ratio * dr::select(real, f.mei.sigma_t * dr::rcp(sigma_t), 1.f);
        dr::masked(value, null) *= by_null;
        dr::masked(density, null) *= by_null;
        density *= f.density;
        Float mean = Channels::mean(density);
        dr::masked(f.flux, f.active) = f.flux * value * dr::rcp(mean);
        dr::masked(f.density, f.active) = density * dr::rcp(mean);
    }

    // Density of photons is per geometric area, reflection counts the shading normal's cosine.
    static Float shading_ratio(const SurfaceInteraction3f &si) {
        Float shading = dr::abs(Frame3f::cos_theta(si.wi)),
              geometric = dr::abs(dr::dot(si.n, si.to_world(si.wi)));
        Mask flat = dr::dot(si.n, si.sh_frame.n) > 1.f - 1e-6f;
        return dr::select(flat, 1.f, shading / dr::maximum(geometric, 1e-3f));
    }

    void scatter_medium(Walk &w, const MediumInteraction3f &mei, const Numbers &u, const Mask &active,
                        Mask &scattered, Mask &alive) const {
        PhaseFunctionContext context(nullptr);
        auto phase = mei.medium->phase_function();
        dr::masked(phase, !active) = nullptr;
        auto [wo, weight, pdf] = phase->sample(context, mei, u.lobe, u.direction, active);
        if (m_tables.has_microflakes()) {
            // Mitsuba 3.9.1 draws microflake directions from another density than it evaluates (see
            // docs/ARCHITECTURE.md), so these are drawn uniformly and weighted by the evaluated one.
            Mask flakes = active && has_flag(phase->flags(active), PhaseFunctionFlags::Microflake);
            Vector3f uniform = warp::square_to_uniform_sphere(u.direction);
            auto [value, density] = phase->eval_pdf(context, mei, uniform, flakes);
            dr::masked(wo, flakes) = uniform;
            dr::masked(weight, flakes) = value * (4.f * dr::Pi<Float>);
            dr::masked(pdf, flakes) = density;
        }
        Ray3f next = mei.spawn_ray(wo);
        dr::masked(w.ray, active) = next;
        dr::masked(w.flux, active) *= unpolarized_spectrum(weight);
        if (m_rules.glossy_chains)
            dr::masked(w.lamp_density, active) = 0.f;
        scattered |= active;
        alive |= active && pdf > 0.f;
    }

    void scatter_surface(Walk &w, SurfaceInteraction3f &si, const BSDFPtr &bsdf, const Numbers &u,
                         const Mask &active, const Vector3f &direction, Mask &scattered, Mask &alive) const {
        BSDFContext context(TransportMode::Importance);
        auto [bs, value] = bsdf->sample(context, si, u.lobe, u.direction, active);
        UnpolarizedSpectrum weight = unpolarized_spectrum(value);
        Vector3f wo = si.to_world(bs.wo);
        Mask null = has_flag(bs.sampled_type, BSDFFlags::Null);

        // A mesh may be wound against its own vertex normals: those count.
        Normal3f n = dr::mulsign(si.n, dr::dot(si.n, si.sh_frame.n));
        Mask bent = active && !null && !(dr::dot(n, si.sh_frame.n) > 1.f - 1e-6f);
        if (dr::any_or<true>(bent))
            dr::masked(weight, bent) *= adjoint_of_shading(si, n, -direction, wo, Frame3f::cos_theta(bs.wo));

        Ray3f next = si.spawn_ray(wo);
        dr::masked(w.ray, active) = next;
        dr::masked(w.flux, active) *= weight;
        if (m_rules.glossy_chains)
            dr::masked(w.lamp_density, active && !has_flag(bs.sampled_type, BSDFFlags::Delta)) = 0.f;
        Mask transition = active && si.is_medium_transition();
        if (simulates(VPT_EFFECT_MEDIUM_SAMPLING) && dr::any_or<true>(transition))
            dr::masked(w.medium, transition) = si.target_medium(next.d);
        scattered |= active && !null;
        alive |= active && bs.pdf > 0.f;
    }

    // [Veach 1997 (5.19)] `n` is the geometric normal on the side of the shading normal.
    static Float adjoint_of_shading(const SurfaceInteraction3f &si, const Normal3f &n, const Vector3f &wi,
                                    const Vector3f &wo, const Float &out_shading) {
        Float in_geometric = dr::dot(n, wi), out_geometric = dr::dot(n, wo), in_shading = Frame3f::cos_theta(si.wi);
        Mask leaks = in_geometric * in_shading <= 0.f || out_geometric * out_shading <= 0.f;
        Float correction = dr::abs((in_shading * out_geometric) / (out_shading * in_geometric));
        return dr::select(leaks, 0.f, correction);
    }

    // Depth, Russian roulette, and the end of walks that nothing can see any more.
    void finish(Walk &w, const Numbers &u, const Mask &scattered, const Mask &alive) const {
        dr::masked(w.depth, scattered) += 1u;
        Float flux = dr::max(w.flux);
        w.active = alive && flux > 0.f && w.depth < m_rules.max_depth - 1u;
        Float q = survival(Float(flux / w.emitted), w.depth);
        Mask roulette = w.active && w.depth > m_rules.rr_depth;
        w.active &= !roulette || u.roulette < q;
        dr::masked(w.flux, roulette) *= dr::rcp(q);
    }

    const Scene *m_scene;
    const Tables &m_tables;
    const Channels &m_band;
    VptRules m_rules;
    uint32_t m_lanes = 0;
    std::vector<Walk> m_walks;
};

}
