// The variants that the plugin works in.
#pragma once

#include <mitsuba/core/object.h>

#include "vpt.h"

#include <memory>

namespace vpt {

// What of the shim is compiled for one variant.
struct Variant {
    const char *name;
    mitsuba::ObjectType type;
    mitsuba::ref<mitsuba::Object> (*instantiate)(void *, const mitsuba::Properties &props);
    // Gives the engine's callbacks for a scene, to be used until the returned owner is released.
    std::shared_ptr<void> (*lend)(mitsuba::Object *scene, uint32_t sensor, VptHost *out);
    // Of the scene's integrator; the strings live as long as the scene does.
    void (*parameters)(mitsuba::Object *scene, uint32_t sensor, VptParameters *out);
};

Variant scalar_rgb();
Variant scalar_spectral();
Variant llvm_ad_rgb();
Variant llvm_ad_mono();
Variant llvm_ad_spectral();
Variant cuda_ad_rgb();
Variant cuda_ad_mono();
Variant cuda_ad_spectral();

// Refuses a name that is none of them.
Variant variant(std::string_view name);

// Refuses a libLLVM that Dr.Jit loads but that cannot translate its kernels.
void require_usable_llvm(std::string_view variant);

// All variants: those above, and a refusal for every other.
void register_all(std::string_view name, mitsuba::PluginRegisterFn callback);

// Makes Mitsuba's plugin manager know "vpt", so that it looks for no file of that name.
void install();

}
