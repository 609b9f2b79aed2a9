// Planes of the host's memory that the results of a batch go to, and what they get.
#pragma once

#include "mitsuba.h"

#include <algorithm>
#include <cstring>
#include <nanothread/nanothread.h>
#include <string>
#include <utility>
#include <vector>

namespace vpt {

using namespace mitsuba;

// A null plane is not asked for. Of triples, three planes follow each other.
struct Planes {
    std::vector<uint32_t *> uints;
    std::vector<float *> floats, triples;

    // Tells which are asked for, as text.
    std::string pattern() const {
        std::string out;
        auto add = [&out](const auto &planes) {
            for (auto *plane : planes)
                out += plane ? '1' : '0';
            out += ' ';
        };
        add(uints);
        add(floats);
        add(triples);
        return out;
    }
};

// What goes there: one value of Dr.Jit's for each plane, nothing in scalar variants.
template <typename Float> class PlaneValues {
public:
    using UInt32 = dr::uint32_array_t<Float>;
    static constexpr bool Jit = dr::is_jit_v<Float>;

    PlaneValues(size_t count, const Planes &planes) : m_count(count) {
        if constexpr (Jit) {
            for (uint32_t *plane : planes.uints)
                add(m_uints, plane);
            for (float *plane : planes.floats)
                add(m_floats, plane);
            for (float *plane : planes.triples)
                for (size_t i = 0; i < 3; ++i)
                    add(m_floats, plane ? plane + i * count : nullptr);
        }
    }

    // Evaluates what is pending and copies it to the host.
    void flush() {
        if constexpr (Jit) {
            schedule();
            dr::eval();
            std::vector<Copy> copies;
            collect(m_floats, copies);
            collect(m_uints, copies);
            make(copies);
            m_floats.clear();
            m_uints.clear();
        }
    }

    // Schedules the values, for callers that evaluate more than these.
    void schedule() {
        each([](auto &value) { dr::schedule(value); });
    }

    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro callback) const {
        each([&](auto &value) { dr::traverse_1_fn_ro(value, payload, callback); });
    }

    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw callback) {
        each([&](auto &value) { dr::traverse_1_fn_rw(value, payload, callback); });
    }

protected:
    template <typename Plane> auto &value_of(const Plane *plane) {
        if constexpr (std::is_same_v<Plane, float>)
            return find(m_floats, plane);
        else
            return find(m_uints, plane);
    }

    template <typename Visitor> void each(Visitor &&visit) {
        for (auto &output : m_floats)
            visit(output.second);
        for (auto &output : m_uints)
            visit(output.second);
    }

    template <typename Visitor> void each(Visitor &&visit) const {
        const_cast<PlaneValues *>(this)->each([&](const auto &value) { visit(value); });
    }

    size_t m_count;
    std::vector<std::pair<float *, Float>> m_floats;
    std::vector<std::pair<uint32_t *, UInt32>> m_uints;

private:
    template <typename Outputs, typename Plane> static void add(Outputs &outputs, Plane *plane) {
        if (plane)
            outputs.emplace_back().first = plane;
    }

    template <typename Outputs, typename Plane> static auto &find(Outputs &outputs, const Plane *plane) {
        for (auto &[candidate, value] : outputs)
            if (candidate == plane)
                return value;
        Throw("a result was not asked for");
    }

    // From the device's memory to the host's.
    struct Copy {
        void *to;
        const void *from;
    };

    // Planes of fewer bytes in all are sooner copied than handed to other threads.
    static constexpr size_t CopiedAlone = 1 << 18;

    // What is to be copied; what is the same everywhere is written at once.
    template <typename Outputs> void collect(Outputs &outputs, std::vector<Copy> &copies) const {
        for (auto &[plane, value] : outputs) {
            if (jit_var_state(value.index()) == VarState::Literal)
                std::fill_n(plane, m_count, value.entry(0));
            else if (value.index())
                copies.push_back({ plane, value.data() });
        }
    }

    // Memory of a CPU is copied by all of Dr.Jit's threads: while one does it alone, the others wait for it.
    void make(const std::vector<Copy> &copies) const {
        size_t bytes = m_count * 4;
        if constexpr (dr::is_llvm_v<Float>) {
            if (bytes * copies.size() > CopiedAlone) {
                jit_sync_thread();
                dr::parallel_for(dr::blocked_range<size_t>(0, copies.size()), [&](const dr::blocked_range<size_t> &range) {
                    for (size_t i = range.begin(); i != range.end(); ++i)
                        std::memcpy(copies[i].to, copies[i].from, bytes);
                });
                return;
            }
        }
        for (const Copy &copy : copies)
            jit_memcpy(dr::backend_v<Float>, copy.to, copy.from, bytes);
    }
};

}
