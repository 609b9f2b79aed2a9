// Russian roulette, as the engine plays it.

#pragma once

#include "mitsuba.h"

namespace vpt {

// Probability with which a path goes on that carries `weight` of what it started with: its weight, but the cap comes
// so near to 1 with depth that weights of light which nothing absorbs grow slower than that light dies out. [Roulette]
template <typename Float, typename UInt32>
Float survival(const Float &weight, const UInt32 &depth) {
    return dr::minimum(weight, 1.f - 2.f / (Float(depth) + 40.f));
}

}
