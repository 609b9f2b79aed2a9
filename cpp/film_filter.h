// The values of a film's reconstruction filter, for the engine to look up.
#pragma once

#include "lanes.h"

namespace vpt {

// Those of equal steps of the distance from a pixel's centre, and that at the filter's radius. Scalar variants of Mitsuba look
// up a table of their own, whose steps these are; others evaluate the filter, which so many steps come close to.
template <typename Float, typename Filter> std::vector<float> film_filter(const Filter *filter) {
    constexpr bool Jit = dr::is_jit_v<Float>;
    if (filter->is_box_filter())
        return { 1.f, 1.f };
    constexpr size_t steps = Jit ? 16384 : MI_FILTER_RESOLUTION, n = steps + 1;
    std::vector<float> distances(n), values(n);
    for (size_t i = 0; i < steps; ++i)
        distances[i] = (i + .5f) * filter->radius() / steps;
    distances[steps] = filter->radius();
    Writer<Float> writer(n, { {}, { values.data() }, {} });
    for (size_t e = 0; e < element_count<Float>(n); ++e) {
        Float distance = read<Float>(distances.data(), n, e);
        if constexpr (Jit)
            writer.put(values.data(), e, filter->eval(distance));
        else
            writer.put(values.data(), e, filter->eval_discretized(distance));
    }
    writer.flush();
    return values;
}

}
