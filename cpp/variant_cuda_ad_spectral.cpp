#include "variant.h"

vpt::Variant vpt::cuda_ad_spectral() {
    using Float = dr::DiffArray<JitBackend::CUDA, float>;
    return Door<Float, mitsuba::Spectrum<Float, 4>>::variant("cuda_ad_spectral");
}
