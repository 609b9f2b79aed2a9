// Emitters and shapes in an order that the scene decides, and the choice of a lamp in it. Mitsuba merges meshes by a hash
// table over addresses, so that its own order, and what a random number chooses, differs from run to run.
#pragma once

#include "lanes.h"

#include <mitsuba/core/distr_1d.h>

#include <algorithm>
#include <memory>
#include <string>
#include <tuple>

namespace vpt {

// By name and place; of those that agree in both, as they come.
template <typename Object, typename Shape>
std::vector<Object *> in_order(std::vector<Object *> objects, const Shape *(*shape_of)(const Object *)) {
    auto key = [shape_of](const Object *object) {
        const Shape *shape = shape_of(object);
        auto bounds = shape ? shape->bbox() : object->bbox();
        return std::make_tuple(std::string(object->id()), std::string(shape ? shape->id() : ""), bounds.min.x(),
                               bounds.min.y(), bounds.min.z(), bounds.max.x(), bounds.max.y(), bounds.max.z());
    };
    std::stable_sort(objects.begin(), objects.end(), [&](auto *a, auto *b) { return key(a) < key(b); });
    return objects;
}

template <typename Float, typename Spectrum> class Lamps {
public:
    MI_IMPORT_TYPES(Scene, Shape, Emitter, EmitterPtr)

    // A lamp, the inverse of the probability that it was chosen with, and a number that may serve again.
    struct Choice {
        EmitterPtr emitter;
        Float weight, number;
    };

    explicit Lamps(Scene *scene) {
        std::vector<Emitter *> emitters;
        for (auto &emitter : scene->emitters())
            emitters.push_back(emitter.get());
        m_emitters = in_order<Emitter, Shape>(emitters, [](const Emitter *emitter) { return emitter->shape(); });
        std::vector<ScalarFloat> weights;
        for (Emitter *emitter : m_emitters)
            weights.push_back(emitter->sampling_weight());
        if (std::any_of(weights.begin(), weights.end(), [](ScalarFloat weight) { return weight != 1.f; }))
            m_distribution = std::make_unique<DiscreteDistribution<Float>>(weights.data(), weights.size());
        m_emitters_dr = dr::load<DynamicBuffer<EmitterPtr>>(m_emitters.data(), m_emitters.size());
        if constexpr (dr::is_jit_v<Float>)
            dr::eval(m_emitters_dr);
    }

    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro callback) const {
        dr::traverse_1_fn_ro(dr::tie(m_emitters_dr, m_distribution), payload, callback);
    }

    const std::vector<Emitter *> &all() const { return m_emitters; }

    // As Scene::sample_emitter does, but in this order.
    Choice choose(const Float &number, const Mask &active) const {
        if (m_distribution) {
            auto [index, again, probability] = m_distribution->sample_reuse_pmf(number, active);
            return { dr::gather<EmitterPtr>(m_emitters_dr, index, active), dr::rcp(probability), again };
        }
        ScalarFloat count = (ScalarFloat) m_emitters.size();
        Float scaled = number * count;
        UInt32 index = dr::minimum(UInt32(scaled), (uint32_t) m_emitters.size() - 1u);
        return { dr::gather<EmitterPtr>(m_emitters_dr, index, active), count, scaled - Float(index) };
    }

private:
    std::vector<Emitter *> m_emitters;
    std::unique_ptr<DiscreteDistribution<Float>> m_distribution;
    DynamicBuffer<EmitterPtr> m_emitters_dr;
};

}
