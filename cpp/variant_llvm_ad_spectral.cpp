#include "variant.h"

vpt::Variant vpt::llvm_ad_spectral() {
    using Float = dr::DiffArray<JitBackend::LLVM, float>;
    return Door<Float, mitsuba::Spectrum<Float, 4>>::variant("llvm_ad_spectral");
}
