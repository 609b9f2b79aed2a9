// Which directions view rays follow of surfaces that are glossy. [Glossy chain]
#pragma once

#include "mitsuba.h"

namespace vpt {

using namespace mitsuba;

// A function of both directions and of the lamp alone, so that rays that follow sampled directions and visible points that look
// at all others share a lobe without overlap. Delta lobes have rays of their own; what is Lambertian is never sharp (1/pi at
// most). `lamp_density` is 0 for light that was scattered on its way, and infinite for lamps that no ray meets.
template <typename Flags, typename Float> auto is_sharp(const Flags &flags, const Float &pdf, const Float &lamp_density) {
    return !has_flag(flags, BSDFFlags::Delta) && pdf > dr::maximum(lamp_density, 1.f);
}

}
