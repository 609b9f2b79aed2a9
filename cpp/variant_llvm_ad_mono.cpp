#include "variant.h"

vpt::Variant vpt::llvm_ad_mono() {
    using Float = dr::DiffArray<JitBackend::LLVM, float>;
    return Door<Float, mitsuba::Color<Float, 1>>::variant("llvm_ad_mono");
}
