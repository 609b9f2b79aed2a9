// Where a loop over steps puts the vertices of each: planes in the device's memory, a slot for each step and lane.
#pragma once

#include "lanes.h"

#include <initializer_list>
#include <utility>
#include <vector>

namespace vpt {

// For Dr.Jit variants. Takes what a Writer takes, but from within a loop: all planes are there before it is recorded.
template <typename Float> class Slots {
public:
    using UInt32 = dr::uint32_array_t<Float>;
    using Mask = dr::mask_t<Float>;

    // Where nothing is put, planes of integers hold `absent`; planes of floats may be null.
    Slots(size_t count, uint32_t absent, std::initializer_list<uint32_t *> uints, std::initializer_list<float *> floats,
          std::initializer_list<float *> triples)
        : m_count(count) {
        for (uint32_t *plane : uints)
            m_uints.emplace_back(plane, dr::opaque<UInt32>(absent, count));
        for (float *plane : floats)
            add(plane);
        for (float *planes : triples)
            for (size_t i = 0; i < 3 && planes; ++i)
                add(planes + i * count);
    }

    // Where what comes next is put.
    void select(const UInt32 &slot, const Mask &active) {
        m_slot = slot;
        m_active = active;
    }

    void put(float *plane, size_t, const Float &value) { dr::scatter(find(m_floats, plane), value, m_slot, m_active); }

    void put(uint32_t *plane, size_t, const UInt32 &value) {
        dr::scatter(find(m_uints, plane), value, m_slot, m_active);
    }

    template <typename Vector> void put3(float *planes, size_t element, const Vector &value) {
        for (size_t i = 0; i < 3; ++i)
            put(planes + i * m_count, element, value[i]);
    }

    // Schedules the outputs, for callers that evaluate more than these.
    void schedule() {
        // What the loop's recording left here does not outlive it.
        m_slot = 0u;
        m_active = false;
        for (auto &output : m_floats)
            dr::schedule(output.second);
        for (auto &output : m_uints)
            dr::schedule(output.second);
    }

    // Evaluates what is pending and copies it to the host.
    void flush() {
        schedule();
        dr::eval();
        copy(m_floats);
        copy(m_uints);
    }

private:
    void add(float *plane) {
        if (plane)
            m_floats.emplace_back(plane, dr::empty<Float>(m_count));
    }

    template <typename Plane, typename Value>
    static Value &find(std::vector<std::pair<Plane *, Value>> &outputs, const Plane *plane) {
        for (auto &[candidate, value] : outputs)
            if (candidate == plane)
                return value;
        Throw("a plane of vertices has no slots");
    }

    template <typename Outputs> void copy(Outputs &outputs) {
        for (auto &[plane, value] : outputs)
            jit_memcpy(dr::backend_v<Float>, plane, value.data(), m_count * 4);
        outputs.clear();
    }

    size_t m_count;
    UInt32 m_slot;
    Mask m_active;
    std::vector<std::pair<float *, Float>> m_floats;
    std::vector<std::pair<uint32_t *, UInt32>> m_uints;
};

}
