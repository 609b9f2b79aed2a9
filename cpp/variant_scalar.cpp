#include "integrator.h"
#include "register.h"

namespace vpt {

void register_scalar_rgb(std::string_view name, mitsuba::PluginRegisterFn callback) {
    using namespace mitsuba;
    using Float = float;
    using Vpt = VptIntegrator<Float, Color<Float, 3>>;
    callback(name, "scalar_rgb", Vpt::Type,
             [](void *, const Properties &props) -> ref<Object> { return new Vpt(props); });
}

}
