#include "variant.h"

vpt::Variant vpt::cuda_ad_mono() {
    using Float = dr::DiffArray<JitBackend::CUDA, float>;
    return Door<Float, mitsuba::Color<Float, 1>>::variant("cuda_ad_mono");
}
