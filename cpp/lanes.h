// One template for both kinds of variant. A batch of n lanes is n scalar elements in `scalar_*` and one
// element of width n in Dr.Jit variants: code that handles "an element" serves both.
#pragma once

#include "planes.h"

namespace vpt {

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

// Collects the results of a batch, so that a Dr.Jit variant computes all of them in one kernel.
template <typename Float> class Writer : public PlaneValues<Float> {
public:
    using Base = PlaneValues<Float>;
    using typename Base::UInt32;
    using Base::Jit, Base::m_count;

    Writer(size_t lanes, const Planes &planes) : Base(lanes, planes) {}

    void put(float *plane, size_t element, const Float &value) {
        if constexpr (Jit)
            Base::value_of(plane) = value + dr::zeros<Float>(m_count);
        else
            plane[element] = value;
    }

    void put(uint32_t *plane, size_t element, const UInt32 &value) {
        if constexpr (Jit)
            Base::value_of(plane) = value + dr::zeros<UInt32>(m_count);
        else
            plane[element] = value;
    }

    template <typename Vector> void put3(float *planes, size_t element, const Vector &value) {
        for (size_t i = 0; i < 3; ++i)
            put(planes + i * m_count, element, value[i]);
    }
};

// Any width-1 Dr.Jit value, or a scalar, as a plain number.
template <typename Value> dr::scalar_t<Value> plain(const Value &value) {
    if constexpr (dr::is_jit_v<Value>)
        return value.entry(0);
    else
        return value;
}

}
