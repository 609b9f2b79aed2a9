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

// Best first for a machine without a GPU.
static const std::vector<Variant> &variants() {
    static const std::vector<Variant> all = { scalar_rgb(),  scalar_spectral(), llvm_ad_rgb(),  llvm_ad_mono(),
                                              llvm_ad_spectral(), cuda_ad_rgb(), cuda_ad_mono(), cuda_ad_spectral() };
    return all;
}

static std::string names() {
    std::string out;
    for (const Variant &variant : variants())
        out += (out.empty() ? "" : ", ") + std::string(variant.name);
    return out;
}

Variant variant(std::string_view name) {
    for (const Variant &variant : variants())
        if (name == variant.name)
            return variant;
    Throw("vpt works in the variants %s, not in %s: polarized light is not followed", names(), name);
}

static ref<Object> refuse_variant(void *, const Properties &) {
    Throw("vpt works in the variants %s; polarized light is not followed: choose one without \"polarized\"", names());
}

// A refusal is a constructor that throws, so that no exception leaves the plugin's entry point.
void register_all(std::string_view name, PluginRegisterFn callback) {
    bool fits = fits_loaded_mitsuba();
    for (const std::string &variant : string::tokenize(MI_VARIANTS, "\n"))
        callback(name, variant, ObjectType::Integrator, fits ? refuse_variant : refuse_version);
    if (!fits)
        return;
    for (const Variant &variant : variants())
        callback(name, variant.name, variant.type, variant.instantiate);
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
