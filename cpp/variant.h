// One instantiation of the shim, behind plain functions: each variant has a file of its own.
#pragma once

#include "integrator.h"
#include "register.h"

namespace vpt {

template <typename Float, typename Spectrum> struct Door {
    using Scene = mitsuba::Scene<Float, Spectrum>;
    using Vpt = mitsuba::VptIntegrator<Float, Spectrum>;

    static ref<Object> instantiate(void *, const Properties &props) { return new Vpt(props); }

    static std::shared_ptr<void> lend(Object *root, uint32_t sensor, VptHost *out) {
        auto *scene = dynamic_cast<Scene *>(root);
        auto *lent_sensor = scene->sensors()[sensor].get();
        lent_sensor->film()->prepare({});
        auto host = std::make_shared<Host<Float, Spectrum>>(scene, lent_sensor);
        *out = host->table();
        return host;
    }

    static void parameters(Object *root, uint32_t sensor, VptParameters *out) {
        auto *scene = dynamic_cast<Scene *>(root);
        *out = static_cast<Vpt *>(scene->integrator())->bound_parameters();
        out->passes = scene->sensors()[sensor]->sampler()->sample_count();
    }

    static constexpr Variant variant(const char *name) { return { name, Vpt::Type, &instantiate, &lend, &parameters }; }
};

}
