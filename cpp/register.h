// Each variant's file registers its own instantiation.
#pragma once

#include <mitsuba/core/object.h>

namespace vpt {

void register_scalar_rgb(std::string_view name, mitsuba::PluginRegisterFn callback);
void register_llvm_ad_rgb(std::string_view name, mitsuba::PluginRegisterFn callback);
void register_cuda_ad_rgb(std::string_view name, mitsuba::PluginRegisterFn callback);

// Refuses a libLLVM that Dr.Jit loads but that cannot translate its kernels.
void require_usable_llvm(std::string_view variant);

// All variants: the three above, and a refusal for every other.
void register_all(std::string_view name, mitsuba::PluginRegisterFn callback);

// Makes Mitsuba's plugin manager know "vpt", so that it looks for no file of that name.
void install();

}
