#include "variant.h"

vpt::Variant vpt::llvm_ad_rgb() {
    using Float = dr::DiffArray<JitBackend::LLVM, float>;
    return Door<Float, mitsuba::Color<Float, 3>>::variant("llvm_ad_rgb");
}
