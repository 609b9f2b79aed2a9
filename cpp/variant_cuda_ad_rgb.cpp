#include "variant.h"

vpt::Variant vpt::cuda_ad_rgb() {
    using Float = dr::DiffArray<JitBackend::CUDA, float>;
    return Door<Float, mitsuba::Color<Float, 3>>::variant("cuda_ad_rgb");
}
