#include "variant.h"

vpt::Variant vpt::scalar_rgb() {
    using Float = float;
    return Door<Float, mitsuba::Color<Float, 3>>::variant("scalar_rgb");
}
