// Mitsuba behind the engine's C ABI: a table of callbacks over one scene and one sensor.
#pragma once

#include "aim.h"
#include "film_filter.h"
#include "lamp_light.h"
#include "photon_walk.h"
#include "view_walk.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <nanothread/nanothread.h>

namespace vpt {

template <typename Float, typename Spectrum> class Host {
public:
    MI_IMPORT_TYPES(Scene, Sensor, Film, Medium, MediumPtr, BSDF, BSDFPtr, PhaseFunctionContext,
                    ShapePtr)
    using View = ViewWalk<Float, Spectrum>;
    using Photons = PhotonWalk<Float, Spectrum>;
    using Tables = SceneTables<Float, Spectrum>;
    using Channels = Band<Float, Spectrum>;
    static constexpr bool Jit = dr::is_jit_v<Float>;

    Host(Scene *scene, Sensor *sensor)
        : m_scene(scene), m_sensor(sensor), m_shared_tables(std::make_shared<Tables>(scene, sensor)),
          m_tables(*m_shared_tables), m_band(sensor, .5f), m_media(m_tables.media()),
          m_film_filter(film_filter<Float>(sensor->film()->rfilter())) {
        for (auto &warning : m_tables.warnings())
            m_warnings.push_back(warning.c_str());
    }

    // The same at the wavelengths that a number in [0,1) chooses.
    Host(const Host &other, float number)
        : m_scene(other.m_scene), m_sensor(other.m_sensor), m_shared_tables(other.m_shared_tables),
          m_tables(*m_shared_tables), m_band(m_sensor, number), m_media(m_tables.media(m_band.wavelengths(1))),
          m_film_filter(other.m_film_filter), m_warnings(other.m_warnings) {}

    // Where Dr.Jit has the scene to itself its threads are lent. Those of the engine would compete with them: they wait busily.
    VptHost table() {
        return { VPT_ABI_VERSION, this,           &c_describe,    &c_tune,        &c_tuned_free, &c_view_rays,  &c_view_step,
                 &c_view_free,    &c_emit,        &c_photon_alive, &c_photon_step, &c_photon_free,
                 &c_extinction,   &c_scattering,  &c_eval_phase,  &c_store_points, &c_eval_bsdf,
                 &c_lamp_light,   &c_aim,         Jit ? &c_spawn : nullptr, Jit ? &c_work_until : nullptr,
                 &c_last_error };
    }

    VptDescription describe() const {
        const Film *film = m_sensor->film();
        auto size = film->crop_size();
        auto offset = ScalarPoint2i(film->crop_offset());
        if (film->sample_border()) {
            size += 2 * film->rfilter()->border_size();
            offset -= (int) film->rfilter()->border_size();
        }
        VptDescription out{};
        out.film_size[0] = size.x();
        out.film_size[1] = size.y();
        out.film_offset[0] = offset.x();
        out.film_offset[1] = offset.y();
        auto block = const_cast<Film *>(film)->create_block();
        out.film_channels = block->channel_count();
        out.film_pixels = block->width() * block->height();
        out.film_width = block->width();
        out.film_filter_radius = film->rfilter()->radius();
        out.film_filter = m_film_filter.data();
        out.film_filter_count = (uint32_t) m_film_filter.size();
        out.spectral = Channels::Spectral;
        for (size_t channel = 0; channel < 3; ++channel)
            std::copy_n(m_band.colours(channel), 3, out.channel_colours[channel]);
        out.media = m_media.data();
        out.media_count = (uint32_t) m_media.size();
        auto bounds = m_scene->bbox();
        for (size_t i = 0; i < 3; ++i) {
            out.bounds_min[i] = bounds.min[i];
            out.bounds_max[i] = bounds.max[i];
        }
        out.surfaces = m_tables.surfaces().data();
        out.surface_count = (uint32_t) m_tables.surfaces().size();
        out.emitters = m_tables.emitters().data();
        out.emitter_count = (uint32_t) m_tables.emitters().size();
        out.sensor_name = m_tables.sensor_name();
        out.has_aperture = m_sensor->needs_aperture_sample();
        out.warnings = m_warnings.data();
        out.warning_count = (uint32_t) m_warnings.size();
        out.lanes = Jit ? 1u << 17 : 1u << 10;
        out.launch = launch();
        out.concurrent = !Jit;
        return out;
    }

    void extinction(uint32_t n, const uint32_t *medium, const float *position, const float *direction, float *out) {
        coefficients<2>(n, medium, position, direction, out);
    }

    void scattering(uint32_t n, const uint32_t *medium, const float *position, const float *direction, float *out) {
        coefficients<0>(n, medium, position, direction, out);
    }

    void eval_phase(uint32_t n, const uint32_t *medium, const float *position, const float *photon_direction,
                    const float *view_direction, float *out) {
        Writer<Float> writer(n, { {}, {}, { out } });
        PhaseFunctionContext context(nullptr);
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            Place place = place_of(n, e, medium, position, photon_direction);
            Vector3f wo = -read3<Vector3f>(view_direction, n, e);
            m_tables.run({ "phase" }, dr::tie(place, wo, m_band), dr::tie(writer), [&] {
                MediumInteraction3f mei = interaction(place);
                auto [value, pdf] = mei.medium->phase_function()->eval_pdf(context, mei, wo, true);
                writer.put3(out, e, Channels::channels(unpolarized_spectrum(value)));
            });
        }
        writer.flush();
    }

    void store_points(uint32_t n, const float *origin, const float *direction, const uint32_t *skips_emitters,
                      bool glossy_chains) {
        m_glossy_chains = glossy_chains;
        m_points.clear();
        m_points.reserve(element_count<Float>(n));
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            Ray3f ray = dr::zeros<Ray3f>();
            ray.o = read3<Point3f>(origin, n, e);
            ray.d = read3<Vector3f>(direction, n, e);
            ray.maxt = dr::Largest<Float>;
            ray.time = m_sensor->shutter_open();
            ray.wavelengths = m_band.wavelengths(n);
            UInt32 skips = read<UInt32>(skips_emitters, n, e);
            SurfaceInteraction3f &point = m_points.emplace_back();
            m_tables.run({ "points" }, dr::tie(ray, skips), dr::tie(point),
                         [&] { point = View::intersect(m_scene, ray, skips != 0u, true); });
        }
    }

    void eval_bsdf(uint32_t n, const uint32_t *point, const float *photon_direction, const float *lamp_density, float *out) {
        Writer<Float> writer(n, { {}, {}, { out } });
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            UInt32 number = read<UInt32>(point, n, e);
            Vector3f direction = read3<Vector3f>(photon_direction, n, e);
            Float density = m_glossy_chains ? read<Float>(lamp_density, n, e) : 0.f;
            auto evaluate = [&](const SurfaceInteraction3f &si) {
                writer.put3(out, e, Channels::channels(bsdf_over_cosine(si, -direction, density)));
            };
            if constexpr (Jit)
                m_tables.run({ m_glossy_chains ? "BSDF but for sharp lobes" : "BSDF" },
                             dr::tie(m_points[0], number, direction, density), dr::tie(writer), [&] { evaluate(dr::gather<SurfaceInteraction3f>(m_points[0], number)); });
            else
                evaluate(m_points[number]);
        }
        writer.flush();
    }

    void lamp_light(uint32_t n, const uint32_t *medium, const float *position, const float *normal, const float *numbers,
                    float *direction, float *irradiance, float *density) {
        Planes asked{ {}, { density }, { direction, irradiance } };
        Writer<Float> writer(n, asked);
        vpt::LampLight<Float, Spectrum> light(m_scene, m_sensor, m_tables, m_band);
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            Point3f p = read3<Point3f>(position, n, e);
            Normal3f normals = read3<Normal3f>(normal, n, e);
            UInt32 media = read<UInt32>(medium, n, e);
            Point3f u = read3<Point3f>(numbers, n, e);
            m_tables.run({ "lamp light", nullptr, &asked }, dr::tie(p, normals, media, u, m_band), dr::tie(writer), [&] {
                auto sample = light.sample(p, normals, m_tables.medium(media, true), Point2f(u.x(), u.y()),
                                           UInt32(u.z() * 0x1p24f));
                writer.put3(direction, e, sample.direction);
                writer.put3(irradiance, e, Channels::channels(sample.irradiance));
                if (density)
                    writer.put(density, e, m_tables.lamp_density(sample.emitter, -sample.direction, sample.distance, sample.lit));
            });
        }
        writer.flush();
    }

    void aim(uint32_t n, const float *numbers, float *film) {
        Aim<Float, Spectrum> aim(m_sensor, m_tables, m_band);
        if (!aim.is_possible()) {
            std::fill_n(film, 2 * n, dr::NaN<float>);
            return;
        }
        Writer<Float> writer(n, { {}, { film, film + n }, {} });
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            Float lamp = read<Float>(numbers, n, e);
            Point2f place(read<Float>(numbers + n, n, e), read<Float>(numbers + 2 * n, n, e));
            m_tables.run({ "aim" }, dr::tie(lamp, place, m_band), dr::tie(writer), [&] {
                Point2f seen = aim.sample(lamp, place);
                writer.put(film, e, seen.x());
                writer.put(film + n, e, seen.y());
            });
        }
        writer.flush();
    }

private:
    // As many vertices as a call costs where Dr.Jit writes a program anew: each material is part of it.
    uint32_t launch() const {
        if constexpr (!Jit)
            return 1;
        std::unordered_set<const BSDF *> materials;
        for (const auto &shape : m_scene->shapes())
            materials.insert(shape->bsdf());
        return (1u << 15) * std::clamp<uint32_t>((uint32_t) materials.size() / 8u, 1u, 8u);
    }

    // One of sigma_s, sigma_n and sigma_t.
    template <size_t Which>
    void coefficients(uint32_t n, const uint32_t *medium, const float *position, const float *direction, float *out) {
        Writer<Float> writer(n, { {}, {}, { out } });
        for (size_t e = 0; e < element_count<Float>(n); ++e) {
            Place place = place_of(n, e, medium, position, direction);
            m_tables.run({ Which == 0 ? "scattering" : "extinction" }, dr::tie(place, m_band), dr::tie(writer), [&] {
                MediumInteraction3f mei = interaction(place);
                writer.put3(out, e, Channels::channels(std::get<Which>(mei.medium->get_scattering_coefficients(mei, true))));
            });
        }
        writer.flush();
    }

    // In a medium, seen along a direction.
    struct Place {
        UInt32 medium;
        Point3f position;
        Vector3f direction;
        DRJIT_STRUCT(Place, medium, position, direction)
    };

    static Place place_of(uint32_t n, size_t e, const uint32_t *medium, const float *position, const float *direction) {
        return { read<UInt32>(medium, n, e), read3<Point3f>(position, n, e), read3<Vector3f>(direction, n, e) };
    }

    MediumInteraction3f interaction(const Place &place) const {
        size_t n = dr::width(place);
        MediumInteraction3f mei = dr::zeros<MediumInteraction3f>(n);
        mei.p = place.position;
        mei.wi = -place.direction;
        mei.wavelengths = m_band.wavelengths(n);
        mei.sh_frame = Frame3f(mei.wi);
        mei.t = 0.f;
        mei.medium = m_tables.medium(place.medium, true);
        return mei;
    }

    UnpolarizedSpectrum bsdf_over_cosine(const SurfaceInteraction3f &si, const Vector3f &direction,
                                         const Float &lamp_density) const {
        BSDFContext context(TransportMode::Radiance);
        Vector3f wo = si.to_local(direction);
        Float cosine = dr::abs(Frame3f::cos_theta(wo));
        Mask active = si.is_valid() && cosine > 1e-6f;
        BSDFPtr bsdf = si.bsdf();
        Spectrum spectrum;
        if (m_glossy_chains) {
            Float pdf;
            std::tie(spectrum, pdf) = bsdf->eval_pdf(context, si, wo, active);
            active &= !is_sharp(bsdf->flags(active), pdf, lamp_density);
        } else {
            spectrum = bsdf->eval(context, si, wo, active);
        }
        return dr::select(active, unpolarized_spectrum(spectrum) / cosine, 0.f);
    }

    // No C++ exception crosses the C ABI: it becomes a status and a sentence. Denormals are zero: without that the same
    // walks took up to half as long again, by how the compiler laid out the stack (a vector of three has a fourth lane,
    // which may hold anything).
    template <typename Body> static int32_t guarded(Body &&body) noexcept {
        dr::scoped_flush_denormals flushes(true);
        try {
            body();
            return 0;
        } catch (const std::exception &e) {
            last_error() = e.what();
        } catch (...) {
            last_error() = "Mitsuba threw an exception of an unknown type";
        }
        return 1;
    }

    static std::string &last_error() {
        thread_local std::string sentence;
        return sentence;
    }

    static Host *self(void *context) { return static_cast<Host *>(context); }

    static int32_t c_describe(void *c, VptDescription *out) {
        return guarded([&] { *out = self(c)->describe(); });
    }
    static int32_t c_tune(void *c, float number, void **tuned) {
        return guarded([&] { *tuned = new Host(*self(c), number); });
    }
    static void c_tuned_free(void *, void *tuned) {
        guarded([&] { delete self(tuned); });
    }
    static int32_t c_view_rays(void *c, const VptViewRequest *request, void **walk, uint32_t *alive) {
        return guarded([&] {
            auto *view = new View(self(c)->m_scene, self(c)->m_sensor, self(c)->m_tables, self(c)->m_band, *request);
            *walk = view;
            *alive = view->lanes();
        });
    }
    static int32_t c_view_step(void *, void *walk, uint32_t steps, const float *numbers, const VptViewVertices *out,
                               uint32_t *alive) {
        return guarded([&] {
            static_cast<View *>(walk)->step(steps, numbers, *out);
            *alive = static_cast<View *>(walk)->lanes();
        });
    }
    static void c_view_free(void *, void *walk) {
        guarded([&] { delete static_cast<View *>(walk); });
    }
    static int32_t c_emit(void *c, uint32_t lanes, const float *numbers, const VptRules *rules, void **walk,
                          uint32_t *alive) {
        return guarded([&] {
            auto *photons = new Photons(self(c)->m_scene, self(c)->m_sensor, self(c)->m_tables, self(c)->m_band, lanes, numbers, *rules);
            *walk = photons;
            *alive = photons->lanes();
        });
    }
    static int32_t c_photon_alive(void *, void *walk, uint32_t *out) {
        return guarded([&] { static_cast<Photons *>(walk)->alive(out); });
    }
    static int32_t c_photon_step(void *, void *walk, uint32_t steps, const float *numbers,
                                 const VptPhotonVertices *out, uint32_t *alive) {
        return guarded([&] {
            static_cast<Photons *>(walk)->step(steps, numbers, *out);
            *alive = static_cast<Photons *>(walk)->lanes();
        });
    }
    static void c_photon_free(void *, void *walk) {
        guarded([&] { delete static_cast<Photons *>(walk); });
    }
    static int32_t c_extinction(void *c, uint32_t n, const uint32_t *medium, const float *position,
                                const float *direction, float *out) {
        return guarded([&] { self(c)->extinction(n, medium, position, direction, out); });
    }
    static int32_t c_scattering(void *c, uint32_t n, const uint32_t *medium, const float *position,
                                const float *direction, float *out) {
        return guarded([&] { self(c)->scattering(n, medium, position, direction, out); });
    }
    static int32_t c_eval_phase(void *c, uint32_t n, const uint32_t *medium, const float *position,
                                const float *photon_direction, const float *view_direction, float *out) {
        return guarded([&] { self(c)->eval_phase(n, medium, position, photon_direction, view_direction, out); });
    }
    static int32_t c_store_points(void *c, uint32_t n, const float *origin, const float *direction,
                                  const uint32_t *skips_emitters, uint32_t glossy_chains) {
        return guarded([&] { self(c)->store_points(n, origin, direction, skips_emitters, glossy_chains != 0); });
    }
    static int32_t c_eval_bsdf(void *c, uint32_t n, const uint32_t *point, const float *photon_direction,
                               const float *lamp_density, float *out) {
        return guarded([&] { self(c)->eval_bsdf(n, point, photon_direction, lamp_density, out); });
    }
    static int32_t c_lamp_light(void *c, uint32_t n, const uint32_t *medium, const float *position, const float *normal,
                                const float *numbers, float *direction, float *irradiance, float *density) {
        return guarded([&] { self(c)->lamp_light(n, medium, position, normal, numbers, direction, irradiance, density); });
    }
    static int32_t c_aim(void *c, uint32_t n, const float *numbers, float *film) {
        return guarded([&] { self(c)->aim(n, numbers, film); });
    }
    // Dr.Jit's threads hold denormals to be zero; the engine's tasks reckon with them, whichever thread does them.
    static int32_t c_spawn(void *, void (*task)(void *), void *payload) {
        struct Errand {
            void (*task)(void *);
            void *payload;
        } errand{ task, payload };
        return guarded([&] {
            auto run = [](uint32_t, void *errand) {
                dr::scoped_flush_denormals keeps(false);
                auto [task, payload] = *static_cast<Errand *>(errand);
                task(payload);
            };
            task_release(task_submit(nullptr, 1, run, &errand, sizeof(errand), nullptr, 1));
        });
    }
    static int32_t c_work_until(void *, uint32_t (*is_done)(void *), void *payload) {
        struct Criterion {
            uint32_t (*is_done)(void *);
            void *payload;
        } criterion{ is_done, payload };
        return guarded([&] {
            auto stops = [](void *criterion) {
                auto [is_done, payload] = *static_cast<Criterion *>(criterion);
                return is_done(payload) != 0;
            };
            pool_work_until(nullptr, stops, &criterion);
        });
    }
    static const char *c_last_error(void *) { return last_error().c_str(); }

    Scene *m_scene;
    Sensor *m_sensor;
    std::shared_ptr<const Tables> m_shared_tables;
    const Tables &m_tables;
    Channels m_band;
    std::vector<VptMedium> m_media;
    std::vector<float> m_film_filter;
    std::vector<const char *> m_warnings;
    std::vector<SurfaceInteraction3f> m_points;
    bool m_glossy_chains = false;
};

}
