// One template for both kinds of variant. A batch of n lanes is n scalar elements in `scalar_*` and one
// element of width n in Dr.Jit variants: code that handles "an element" serves both.
#pragma once

#include "mitsuba.h"

#include <utility>
#include <vector>

namespace vpt {

using namespace mitsuba;

// Elements that hold n lanes.
template <typename Float> size_t element_count(size_t lanes) {
    return dr::is_jit_v<Float> ? (lanes > 0 ? 1 : 0) : lanes;
}

template <typename Value> Value read(const dr::scalar_t<Value> *plane, size_t lanes, size_t element) {
    if constexpr (dr::is_jit_v<Value>)
        return dr::load<Value>(plane, lanes);
    else
        return plane[element];
}

// Three planes, one after the other.
template <typename Vector>
Vector read3(const float *planes, size_t lanes, size_t element) {
    using Float = dr::value_t<Vector>;
    return Vector(read<Float>(planes, lanes, element),
                  read<Float>(planes + lanes, lanes, element),
                  read<Float>(planes + 2 * lanes, lanes, element));
}

// Collects the outputs of a batch, so that a Dr.Jit variant computes all of them in one kernel.
template <typename Float> class Writer {
public:
    using UInt32 = dr::uint32_array_t<Float>;
    static constexpr bool Jit = dr::is_jit_v<Float>;

    explicit Writer(size_t lanes) : m_lanes(lanes) {}

    void put(float *plane, size_t element, const Float &value) {
        if constexpr (Jit)
            m_floats.emplace_back(plane, value + dr::zeros<Float>(m_lanes));
        else
            plane[element] = value;
    }

    void put(uint32_t *plane, size_t element, const UInt32 &value) {
        if constexpr (Jit)
            m_uints.emplace_back(plane, value + dr::zeros<UInt32>(m_lanes));
        else
            plane[element] = value;
    }

    template <typename Vector> void put3(float *planes, size_t element, const Vector &value) {
        for (size_t i = 0; i < 3; ++i)
            put(planes + i * m_lanes, element, value[i]);
    }

    // Schedules the outputs, for callers that evaluate more than these.
    void schedule() {
        for (auto &output : m_floats)
            dr::schedule(output.second);
        for (auto &output : m_uints)
            dr::schedule(output.second);
    }

    // Evaluates what is pending and copies it to the host.
    void flush() {
        if constexpr (Jit) {
            schedule();
            dr::eval();
            copy(m_floats);
            copy(m_uints);
        }
    }

private:
    template <typename Outputs> void copy(Outputs &outputs) {
        for (auto &[plane, value] : outputs)
            jit_memcpy(dr::backend_v<Float>, plane, value.data(), m_lanes * 4);
        outputs.clear();
    }

    size_t m_lanes;
    std::vector<std::pair<float *, Float>> m_floats;
    std::vector<std::pair<uint32_t *, UInt32>> m_uints;
};

// Any width-1 Dr.Jit value, or a scalar, as a plain number.
template <typename Value> dr::scalar_t<Value> plain(const Value &value) {
    if constexpr (dr::is_jit_v<Value>)
        return value.entry(0);
    else
        return value;
}

}
