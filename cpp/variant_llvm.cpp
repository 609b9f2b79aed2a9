#include "integrator.h"
#include "register.h"

namespace vpt {

void register_llvm_ad_rgb(std::string_view name, mitsuba::PluginRegisterFn callback) {
    using namespace mitsuba;
    using Float = dr::DiffArray<JitBackend::LLVM, float>;
    using Vpt = VptIntegrator<Float, Color<Float, 3>>;
    callback(name, "llvm_ad_rgb", Vpt::Type,
             [](void *, const Properties &props) -> ref<Object> { return new Vpt(props); });
}

}
