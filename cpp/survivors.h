// Lanes that have ended leave those that go on.
#pragma once

#include "lanes.h"

#include <vector>

namespace vpt {

// Moves an element that goes on up behind the `kept` ones, while it is in the cache; a wide element holds all lanes.
template <typename Float, typename State> void keep(std::vector<State> &states, size_t e, size_t &kept) {
    if constexpr (!dr::is_jit_v<Float>) {
        if (!states[e].active)
            return;
        if (kept != e)
            states[kept] = states[e];
    }
    ++kept;
}

// Drops all but the `kept` elements and, in wide ones, the lanes that have ended; returns how many lanes are left.
template <typename Float, typename State>
uint32_t drop_finished(std::vector<State> &states, size_t lanes, size_t kept) {
    using UInt32 = dr::uint32_array_t<Float>;
    states.resize(kept);
    auto left = (uint32_t) kept;
    if constexpr (dr::is_jit_v<Float>) {
        if (states.empty())
            return 0;
        State &state = states[0];
        state.active &= dr::full<dr::mask_t<Float>>(true, lanes);
        dr::eval(state);
        UInt32 alive = dr::compress(state.active);
        left = (uint32_t) alive.size();
        if (left == 0)
            states.clear();
        else if (left < lanes)
            state = dr::gather<State>(state, alive);
    }
    return left;
}

}
