#include "variant.h"

vpt::Variant vpt::scalar_spectral() {
    using Float = float;
    return Door<Float, mitsuba::Spectrum<Float, 4>>::variant("scalar_spectral");
}
