#include "register.h"

#include "mitsuba.h"
#include "vpt.h"

#include <cstdio>

namespace vpt {

using namespace mitsuba;

void require_usable_llvm(std::string_view variant) {
    int major = 0, minor = 0, patch = 0;
    if (!string::starts_with(variant, "llvm_") || !jit_has_backend(JitBackend::LLVM))
        return;
    jit_llvm_version(&major, &minor, &patch);
    if (major < 17)
        Throw("vpt: Dr.Jit has loaded libLLVM %i, which ends the process on some of its instructions; install "
              "libLLVM 17 or newer (Debian: apt install libllvm19), name it in DRJIT_LIBLLVM_PATH, or use "
              "scalar_rgb", major);
}

// One build fits one Mitsuba: class layouts and vtables differ between versions.
static bool fits_loaded_mitsuba() {
    return util::info_build(1).rfind("Mitsuba version " MI_VERSION " ", 0) == 0;
}

static ref<Object> refuse_version(void *, const Properties &) {
    Throw("this vpt plugin was built for Mitsuba " MI_VERSION ", but was loaded by \"%s\"; install "
          "mitsuba==" MI_VERSION ", or build vpt against the version that you have", util::info_build(1));
}

static ref<Object> refuse_variant(void *, const Properties &) {
    Throw("vpt works in the variants scalar_rgb, llvm_ad_rgb and cuda_ad_rgb; spectral, mono and "
          "polarized variants are not supported");
}

// A refusal is a constructor that throws, so that no exception leaves the plugin's entry point.
void register_all(std::string_view name, PluginRegisterFn callback) {
    bool fits = fits_loaded_mitsuba();
    for (const std::string &variant : string::tokenize(MI_VARIANTS, "\n"))
        callback(name, variant, ObjectType::Integrator, fits ? refuse_variant : refuse_version);
    if (!fits)
        return;
    register_scalar_rgb(name, callback);
    register_llvm_ad_rgb(name, callback);
    register_cuda_ad_rgb(name, callback);
}

void install() {
    register_all("vpt", [](std::string_view name, std::string_view variant, ObjectType type,
                           PluginInstantiateFn instantiate) {
        PluginManager::instance()->register_plugin(name, variant, type, instantiate, nullptr, nullptr);
    });
}

}

extern "C" int32_t vpt_shim_install(char *error, size_t size) noexcept {
    try {
        vpt::install();
        return 0;
    } catch (const std::exception &e) {
        std::snprintf(error, size, "%s", e.what());
        return 1;
    }
}

extern "C" void vpt_register_plugin(const char *name, size_t length, void *callback) {
    vpt::register_all(std::string_view(name, length), (mitsuba::PluginRegisterFn) callback);
}
