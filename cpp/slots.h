// Where a loop over steps puts the vertices of each: planes in the device's memory, a slot for each step and lane.
#pragma once

#include "lanes.h"

namespace vpt {

// For Dr.Jit variants. Takes what a Writer takes, but from within a loop: all planes are there before it is recorded.
template <typename Float> class Slots : public PlaneValues<Float> {
public:
    using Base = PlaneValues<Float>;
    using typename Base::UInt32;
    using Mask = dr::mask_t<Float>;
    using Base::m_count;

    // Where nothing is put, planes of integers hold `absent`.
    Slots(size_t count, uint32_t absent, const Planes &planes) : Base(count, planes) {
        for (auto &output : Base::m_uints)
            output.second = dr::opaque<UInt32>(absent, count);
        for (auto &output : Base::m_floats) {
            output.second = dr::empty<Float>(count);
            dr::make_opaque(output.second); // memory, for a program that is replayed
        }
    }

    // Where what comes next is put.
    void select(const UInt32 &slot, const Mask &active) {
        m_slot = slot;
        m_active = active;
    }

    // What a loop's recording left here does not outlive it.
    void finish() { select(0u, false); }

    template <typename Value> void put(dr::scalar_t<Value> *plane, size_t, const Value &value) {
        dr::scatter(Base::value_of(plane), value, m_slot, m_active);
    }

    template <typename Vector> void put3(float *planes, size_t element, const Vector &value) {
        for (size_t i = 0; i < 3; ++i)
            put(planes + i * m_count, element, value[i]);
    }

private:
    UInt32 m_slot;
    Mask m_active;
};

}
