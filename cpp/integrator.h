// `<integrator type="vpt">`: reads the parameters, lends the scene to the engine, fills the film.
#pragma once

#include "host.h"
#include "observer.h"
#include "register.h"

#include <nanothread/nanothread.h>

NAMESPACE_BEGIN(mitsuba)

template <typename Float, typename Spectrum>
class VptIntegrator final : public Integrator<Float, Spectrum> {
public:
    MI_IMPORT_BASE(Integrator, should_stop, m_stop, m_timeout, m_render_timer, m_hide_emitters)
    MI_IMPORT_TYPES(Scene, Sensor, Film, ImageBlock, Sampler)

    VptIntegrator(const Properties &props) : Base(props) {
        vpt::require_usable_llvm(Base::Variant);
        m_preset = props.get<std::string_view>("preset", "");
        m_method = props.get<std::string_view>("method", "ppt");
        m_radius_schedule = props.get<std::string_view>("radius_schedule", "");
        m_shooting = props.get<std::string_view>("shooting", "");
        m_photon_beams = props.get<std::string_view>("photon_beams", "");
        m_effects = props.get<std::string_view>("effects", "auto");
        char error[1024];
        VptParameters defaults;
        if (vpt_default_parameters(m_preset.c_str(), &defaults, error, sizeof(error)) != 0)
            Throw("vpt: %s", error);
        m_parameters = defaults;
        m_parameters.photons = props.get<int64_t>("photons", defaults.photons);
        m_parameters.chains = props.get<int64_t>("chains", defaults.chains);
        m_parameters.jitter_every = props.get<int64_t>("jitter_every", defaults.jitter_every);
        m_parameters.alpha = props.get<ScalarFloat>("alpha", defaults.alpha);
        m_parameters.surface_radius = props.get<ScalarFloat>("surface_radius", 0.f);
        m_parameters.medium_radius = props.get<ScalarFloat>("medium_radius", 0.f);
        m_parameters.max_depth = props.get<int64_t>("max_depth", -1);
        m_parameters.rr_depth = props.get<int64_t>("rr_depth", 5);
        m_parameters.hide_emitters = m_hide_emitters;
        m_parameters.connections = connections(props, defaults.connections);
        m_parameters.emission_rays = props.get<bool>("emission_rays", defaults.emission_rays != 0);
        m_parameters.glossy_chains = props.get<bool>("glossy_chains", defaults.glossy_chains != 0);
        m_parameters.guided_emission = props.get<bool>("guided_emission", defaults.guided_emission != 0);
        m_parameters.connection_samples = props.get<int64_t>("connection_samples", defaults.connection_samples);
        m_parameters.estimate_error = props.get<bool>("estimate_error", true);
        m_parameters.target_error = props.get<ScalarFloat>("target_error", 0.f);
        m_layers = props.get<bool>("layers", false);
        m_parameters.layers = m_layers;
        m_error_image = props.get<bool>("error_image", m_layers && m_parameters.estimate_error);
        if (m_error_image && !m_parameters.estimate_error)
            Throw("vpt: error_image is true, but estimate_error is false, so there would be nothing to see; set "
                  "estimate_error to true");
        m_parameters.timeout = m_timeout;
        VptParameters parameters = bound_parameters();
        if (vpt_check_parameters(&parameters, error, sizeof(error)) != 0)
            Throw("vpt: %s", error);
    }

    TensorXf render(Scene *scene, Sensor *sensor, UInt32 seed, uint32_t spp, bool develop,
                    bool evaluate) override {
        DRJIT_MARK_USED(evaluate);
        dr::suspend_grad<Float> no_gradients;
        m_stop = false;
        m_render_timer.reset();

        Sampler *sampler = sensor->sampler();
        if (spp)
            sampler->set_sample_count(spp);

        Film *film = sensor->film();
        if (has_flag(film->flags(), FilmFlags::Special))
            Throw("vpt: the film \"%s\" wants samples of its own kind; use \"hdrfilm\"", film->class_name());
        film->prepare({});

        vpt::Host<Float, Spectrum> host(scene, sensor);
        VptHost table = host.table();
        VptParameters parameters = bound_parameters();
        parameters.passes = sampler->sample_count();
        parameters.seed = vpt::plain(seed);
        parameters.threads = (uint32_t) pool_size();

        VptDescription description = host.describe();
        std::vector<double> storage((size_t) description.film_pixels * description.film_channels);
        vpt::RenderWatch watch([this] { return should_stop(); });
        VptObserver observer = watch.table();
        Extras extras(m_layers, m_error_image, description.film_pixels);
        char error[4096];
        if (vpt_render(&table, &parameters, &observer, storage.data(), storage.size(),
                       extras.errors(), extras.layers(), error, sizeof(error)) != 0)
            Throw("vpt: %s", error);

        auto aovs = aov_names();
        if (!aovs.empty())
            film->prepare(aovs);
        put(film, storage, description.film_channels, extras);
        return develop ? film->develop() : TensorXf();
    }

    std::vector<std::string> aov_names() const override {
        std::vector<std::string> names;
        if (m_layers)
            names = { "surfaces.R", "surfaces.G", "surfaces.B", "media.R",    "media.G",
                      "media.B",    "emission.R", "emission.G", "emission.B", "samples.Y" };
        if (m_error_image)
            names.insert(names.end(), { "error.R", "error.G", "error.B" });
        return names;
    }

    std::string to_string() const override {
        return tfm::format("VptIntegrator[\n  method = %s,\n  max_depth = %i,\n  photons = %i\n]", m_method,
                           m_parameters.max_depth, m_parameters.photons);
    }

    // As the properties say; the names live as long as the integrator.
    VptParameters bound_parameters() const {
        VptParameters parameters = m_parameters;
        parameters.preset = m_preset.c_str();
        parameters.method = m_method.c_str();
        parameters.radius_schedule = m_radius_schedule.c_str();
        parameters.shooting = m_shooting.c_str();
        parameters.photon_beams = m_photon_beams.c_str();
        parameters.effects = m_effects.c_str();
        return parameters;
    }

    MI_DECLARE_CLASS(VptIntegrator)

private:
    // A boolean, or the word "auto".
    static uint32_t connections(const Properties &props, uint32_t fallback) {
        if (!props.has_property("connections"))
            return fallback;
        if (props.type("connections") == Properties::Type::Bool)
            return props.get<bool>("connections") ? VPT_CONNECTIONS_ON : VPT_CONNECTIONS_OFF;
        std::string value(props.get<std::string_view>("connections"));
        if (value == "auto")
            return VPT_CONNECTIONS_AUTO;
        if (value != "true" && value != "false")
            Throw("vpt: connections is \"%s\", but must be true, false or auto", value);
        return value == "true" ? VPT_CONNECTIONS_ON : VPT_CONNECTIONS_OFF;
    }

    // What the engine gives beside the picture, by pixel; empty where it is not asked for.
    struct Extras {
        Extras(bool with_layers, bool with_errors, size_t pixels)
            : sums(with_layers ? VPT_LAYER_CHANNELS * pixels : 0), error_image(with_errors ? 3 * pixels : 0) {}
        double *layers() { return sums.empty() ? nullptr : sums.data(); }
        float *errors() { return error_image.empty() ? nullptr : error_image.data(); }
        std::vector<double> sums;
        std::vector<float> error_image;
    };

    // The film divides all channels by the weight, the last of the engine's.
    static void put(Film *film, const std::vector<double> &storage, size_t channels, const Extras &extras) {
        ref<ImageBlock> block = film->create_block();
        block->set_offset(film->crop_offset());
        std::vector<float> values;
        for (size_t pixel = 0; pixel < storage.size() / channels; ++pixel) {
            const double *sums = storage.data() + pixel * channels;
            values.insert(values.end(), sums, sums + channels);
            if (!extras.sums.empty()) {
                auto first = extras.sums.begin() + VPT_LAYER_CHANNELS * pixel;
                values.insert(values.end(), first, first + VPT_LAYER_CHANNELS);
            }
            for (size_t channel = 0; channel < 3 && !extras.error_image.empty(); ++channel)
                values.push_back(extras.error_image[3 * pixel + channel] * (float) sums[channels - 1]);
        }
        auto &array = block->tensor().array();
        array = dr::load<std::decay_t<decltype(array)>>(values.data(), values.size());
        film->put_block(block);
    }

    std::string m_preset, m_method, m_radius_schedule, m_shooting, m_photon_beams, m_effects;
    VptParameters m_parameters;
    bool m_error_image, m_layers;
};

NAMESPACE_END(mitsuba)
