// Mitsuba embedded in a program that is not Python: start a variant, load a scene with the `vpt`
// integrator put into it, render a sensor, write the picture. C functions for src/host/session.rs.

#include "bare_walk.h"
#include "observer.h"
#include "register.h"

#include <drjit-core/jit.h>
#include <mitsuba/core/fresolver.h>
#include <mitsuba/core/parser.h>
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/profiler.h>
#include <mitsuba/core/thread.h>
#include <mitsuba/core/bitmap.h>
#include <mitsuba/core/spectrum.h>
#include <nanothread/nanothread.h>

#include <cstring>

using namespace mitsuba;

// Must match `SceneFileArguments` in src/host/session.rs: name and value by turns.
struct VptSceneFile {
    const char *const *defines;
    uint32_t define_count;
    const char *const *settings;
    uint32_t setting_count;
};

namespace {

enum class Kind { Boolean, Integer, Number, Text };

struct Parameter {
    const char *name;
    Kind kind;
    // Whether an integrator of another kind may hand it down to vpt.
    bool common;
};

const Parameter PARAMETERS[] = {
    { "method", Kind::Text, false },           { "photons", Kind::Integer, false },
    { "jitter_every", Kind::Integer, false },  { "alpha", Kind::Number, false },
    { "surface_radius", Kind::Number, false }, { "medium_radius", Kind::Number, false },
    { "radius_schedule", Kind::Text, false },  { "shooting", Kind::Text, false },
    { "photon_beams", Kind::Text, false },     { "chains", Kind::Integer, false },
    { "connections", Kind::Text, false },      { "effects", Kind::Text, false },
    { "preset", Kind::Text, false },           { "emission_rays", Kind::Boolean, false },
    { "glossy_chains", Kind::Boolean, false }, { "guided_emission", Kind::Boolean, false },
    { "connection_samples", Kind::Integer, false },
    { "max_depth", Kind::Integer, true },      { "rr_depth", Kind::Integer, true },
    { "hide_emitters", Kind::Boolean, true },  { "estimate_error", Kind::Boolean, false },
    { "target_error", Kind::Number, false },   { "error_image", Kind::Boolean, false },
    { "layers", Kind::Boolean, false },
    { "timeout", Kind::Number, true },
};

// Threads asked for; 0 for all.
uint32_t render_threads = 0;

// Mitsuba's pool has the size asked for while it renders, and its full size otherwise: with no worker,
// OpenEXR's reader waits for ever (stock `mitsuba -t 1` does so on a scene with an EXR texture).
struct ScopedThreads {
    ScopedThreads() : threads(pool_size()) {
        if (render_threads > 0)
            pool_set_size(nullptr, render_threads);
    }
    ~ScopedThreads() { pool_set_size(nullptr, threads); }
    uint32_t threads;
};

struct LoadedScene {
    std::string variant, notes;
    ref<Object> root;
};

// One of Mitsuba's own integrators, made apart from any scene.
struct OwnIntegrator {
    ref<Object> integrator;
};

// The engine's callbacks for a scene, while the pool has the size asked for.
struct Lent {
    ScopedThreads threads;
    std::shared_ptr<void> host;
};

template <typename Body> int32_t guarded(char *error, size_t size, Body &&body) noexcept {
    std::string sentence;
    try {
        body();
        return 0;
    } catch (const std::exception &e) {
        sentence = e.what();
    } catch (...) {
        sentence = "Mitsuba threw an exception of an unknown type";
    }
    std::strncpy(error, sentence.c_str(), size - 1);
    error[size - 1] = 0;
    return 1;
}

template <typename Float, typename Spectrum> void start_acceleration() {
    Scene<Float, Spectrum>::static_accel_initialization();
}

template <typename Float, typename Spectrum> void stop_acceleration() {
    Scene<Float, Spectrum>::static_accel_shutdown();
}

void start_backend(const std::string &variant) {
    if (string::starts_with(variant, "scalar_"))
        return;
    JitBackend backend = string::starts_with(variant, "llvm_") ? JitBackend::LLVM : JitBackend::CUDA;
    jit_init(1u << (uint32_t) backend);
    if (jit_has_backend(backend)) {
        vpt::require_usable_llvm(variant);
        return;
    }
    if (backend == JitBackend::LLVM)
        Throw("the variant \"%s\" needs the LLVM shared library, which was not found; install it (Debian: "
              "apt install libllvm19) or name it in DRJIT_LIBLLVM_PATH, or use scalar_rgb", variant);
    Throw("the variant \"%s\" needs a CUDA driver and GPU, which were not found; use llvm_ad_rgb or scalar_rgb",
          variant);
}

const Parameter *find_parameter(std::string_view name) {
    for (const Parameter &parameter : PARAMETERS)
        if (name == parameter.name)
            return &parameter;
    return nullptr;
}

void copy_property(Properties &to, const Properties &from, const Parameter &parameter) {
    switch (parameter.kind) {
        case Kind::Boolean: to.set(parameter.name, from.get<bool>(parameter.name)); break;
        case Kind::Integer: to.set(parameter.name, from.get<int64_t>(parameter.name)); break;
        case Kind::Number: to.set(parameter.name, from.get<double>(parameter.name)); break;
        case Kind::Text: to.set(parameter.name, from.get<std::string>(parameter.name)); break;
    }
}

// Sets a parameter from the command line, over what the scene says.
void set_parameter(Properties &props, std::string_view name, const std::string &value) {
    const Parameter *parameter = find_parameter(name);
    if (!parameter) {
        std::string known;
        for (const Parameter &p : PARAMETERS)
            known += (known.empty() ? "" : ", ") + std::string(p.name);
        Throw("the integrator vpt has no parameter \"%s\"; it has: %s", name, known);
    }
    size_t used = 0;
    auto refuse = [&](const char *wanted) {
        Throw("%s is \"%s\", but must be %s", name, value, wanted);
    };
    switch (parameter->kind) {
        case Kind::Boolean:
            if (value != "true" && value != "false")
                refuse("true or false");
            props.set(name, value == "true", false);
            break;
        case Kind::Integer:
            try {
                props.set(name, (int64_t) std::stoll(value, &used), false);
            } catch (const std::logic_error &) {}
            if (used != value.size() || value.empty())
                refuse("an integer");
            break;
        case Kind::Number:
            try {
                props.set(name, std::stod(value, &used), false);
            } catch (const std::logic_error &) {}
            if (used != value.size() || value.empty())
                refuse("a number");
            break;
        case Kind::Text: props.set(name, value, false); break;
    }
}

parser::SceneNode *find_integrator(parser::ParserState &state) {
    for (auto &node : state.nodes)
        if (node.type == ObjectType::Integrator)
            return &node;
    return nullptr;
}

// Puts `vpt` where another integrator stands, or where none does; tells what was kept.
Properties &ensure_vpt(parser::ParserState &state, std::string &notes) {
    parser::SceneNode *node = find_integrator(state);
    if (!node) {
        parser::SceneNode integrator;
        integrator.type = ObjectType::Integrator;
        integrator.props = Properties("vpt");
        integrator.props.set_id("_vpt_integrator");
        integrator.file_index = state.root().file_index;
        integrator.offset = state.root().offset;
        state.root().props.set("_vpt_integrator", Properties::ResolvedReference(state.nodes.size()));
        state.nodes.push_back(std::move(integrator));
        notes = "the scene has no integrator; rendering with vpt and its defaults";
        return state.nodes.back().props;
    }
    std::string former(node->props.plugin_name());
    if (former != "vpt") {
        Properties props("vpt");
        props.set_id(node->props.id());
        std::string kept;
        for (const Parameter &parameter : PARAMETERS) {
            if (!parameter.common || !node->props.has_property(parameter.name))
                continue;
            copy_property(props, node->props, parameter);
            kept += tfm::format("%s%s %s", kept.empty() ? "" : ", ", parameter.name,
                                node->props.as_string(parameter.name));
        }
        node->props = std::move(props);
        notes = tfm::format("the scene's integrator is \"%s\"; rendering with vpt, %s", former,
                            kept.empty() ? "its own defaults" : "keeping " + kept);
    }
    return node->props;
}

// Where Mitsuba looks for its plugins, and for the files of a scene.
ref<FileResolver> new_resolver() {
    ref<FileResolver> resolver = new FileResolver();
    resolver->append(util::library_path().parent_path());
    return resolver;
}

ref<Object> instantiate(const std::string &variant, const char *path, const VptSceneFile &file,
                        std::string &notes) {
    ref<FileResolver> resolver = new_resolver();
    resolver->append(fs::path(path).parent_path());
    set_file_resolver(resolver);

    parser::ParameterList defines;
    for (uint32_t i = 0; i < file.define_count; ++i)
        defines.emplace_back(file.defines[2 * i], file.defines[2 * i + 1]);
    parser::ParserConfig config(variant);
    parser::ParserState state = parser::parse_file(config, path, defines);
    if (state.root().type != ObjectType::Scene)
        Throw("the root element of \"%s\" is not a <scene>", path);
    Properties &props = ensure_vpt(state, notes);
    for (uint32_t i = 0; i < file.setting_count; ++i)
        set_parameter(props, file.settings[2 * i], file.settings[2 * i + 1]);
    parser::transform_all(config, state);
    auto objects = parser::instantiate(config, state);
    if (objects.size() != 1)
        Throw("\"%s\" expands into %i objects, but must be one <scene>", path, (int) objects.size());
    return objects[0];
}

template <typename Float, typename Spectrum> Scene<Float, Spectrum> *as_scene(Object *object) {
    return dynamic_cast<Scene<Float, Spectrum> *>(object);
}

template <typename Float, typename Spectrum> uint32_t sensor_count(Object *root) {
    return (uint32_t) as_scene<Float, Spectrum>(root)->sensors().size();
}

template <typename Float, typename Spectrum> uint32_t emitter_count(Object *root) {
    return (uint32_t) as_scene<Float, Spectrum>(root)->emitters().size();
}

template <typename Float, typename Spectrum> Film<Float, Spectrum> *film(Object *root, uint32_t sensor) {
    return as_scene<Float, Spectrum>(root)->sensors()[sensor]->film();
}

template <typename Float, typename Spectrum>
void film_size(Object *root, uint32_t sensor, uint32_t *out) {
    auto size = film<Float, Spectrum>(root, sensor)->crop_size();
    out[0] = size.x();
    out[1] = size.y();
}

template <typename Float, typename Spectrum>
void render(Object *root, uint32_t sensor, uint32_t seed, uint32_t passes) {
    auto *scene = as_scene<Float, Spectrum>(root);
    scene->integrator()->render(scene, sensor, seed, passes, false, true);
}

// The film's picture without layers and errors, which few formats can hold.
template <typename Float, typename Spectrum> ref<Bitmap> picture(Object *root, uint32_t sensor) {
    ref<Bitmap> bitmap = film<Float, Spectrum>(root, sensor)->bitmap();
    if (bitmap->pixel_format() != Bitmap::PixelFormat::MultiChannel)
        return bitmap;
    for (auto &[layer, part] : bitmap->split())
        if (layer == "<root>")
            return part;
    Throw("the film has no channels of a picture");
}

template <typename Float, typename Spectrum>
void write(Object *root, uint32_t sensor, const fs::path &path) {
    auto *film = ::film<Float, Spectrum>(root, sensor);
    bool film_writes_exr = film->to_string().find("file_format = OpenEXR") != std::string::npos;
    if (path.extension().string() == ".exr" && film_writes_exr)
        film->write(path);
    else
        picture<Float, Spectrum>(root, sensor)->write(path);
}

// The film's sums as they are, pixel by pixel.
template <typename Float, typename Spectrum>
void read_film(Object *root, uint32_t sensor, float *out, size_t size) {
    auto tensor = film<Float, Spectrum>(root, sensor)->develop(true);
    if (tensor.size() != size)
        Throw("the film holds %i values, but %i were expected", (int) tensor.size(), (int) size);
    if constexpr (dr::is_jit_v<Float>) {
        dr::eval(tensor.array());
        jit_memcpy(dr::backend_v<Float>, out, tensor.array().data(), size * sizeof(float));
    } else {
        std::memcpy(out, tensor.data(), size * sizeof(float));
    }
}

// What the film says of itself, and the names of the channels behind its weight with a comma behind each.
template <typename Float, typename Spectrum>
void describe_film(Object *root, uint32_t sensor, std::string &says, std::string &others, uint32_t &has_alpha) {
    auto *film = ::film<Float, Spectrum>(root, sensor);
    says = film->to_string();
    has_alpha = has_flag(film->flags(), FilmFlags::Alpha);
    for (const std::string &name : as_scene<Float, Spectrum>(root)->integrator()->aov_names())
        others += name + ",";
}

void copy_text(const std::string &text, char *out, size_t size) {
    if (text.size() >= size)
        Throw("a text of %i bytes does not fit into %i", (int) text.size(), (int) size);
    std::memcpy(out, text.c_str(), text.size() + 1);
}

template <typename Float, typename Spectrum>
void create_integrator(const Properties &props, ref<Object> &out) {
    auto integrator = PluginManager::instance()->create_object<Integrator<Float, Spectrum>>(props);
    // `volpathmis` is a stand-in for the integrator that it makes.
    if (auto expanded = integrator->expand(); !expanded.empty())
        integrator = static_cast<Integrator<Float, Spectrum> *>(expanded.front().get());
    if (!integrator->aov_names().empty())
        Throw("the integrator \"%s\" renders other channels than a picture's", props.plugin_name());
    out = integrator.get();
}

// Renders with one of Mitsuba's integrators; returns the samples per pixel that its sampler took.
template <typename Float, typename Spectrum>
uint32_t render_with(Object *root, Object *integrator, uint32_t sensor, uint32_t seed, uint32_t spp) {
    auto *scene = as_scene<Float, Spectrum>(root);
    static_cast<Integrator<Float, Spectrum> *>(integrator)->render(scene, sensor, seed, spp, false, true);
    return scene->sensors()[sensor]->sampler()->sample_count();
}

// Linear RGB in f32 for formats that want a transfer curve.
template <typename Float, typename Spectrum>
void read_rgb(Object *root, uint32_t sensor, float *out) {
    ref<Bitmap> bitmap = picture<Float, Spectrum>(root, sensor);
    ref<Bitmap> rgb = bitmap->convert(Bitmap::PixelFormat::RGB, bitmap->component_format(), false);
    std::memcpy(out, rgb->data(), (size_t) rgb->width() * rgb->height() * 3 * sizeof(float));
}

}

extern "C" {

int32_t vpt_session_start(const char *variant_, uint32_t threads, uint32_t verbosity, char *error, size_t size) {
    return guarded(error, size, [&] {
        std::string variant(variant_);
        Thread::static_initialization();
        Logger::static_initialization();
        Bitmap::static_initialization();
        mitsuba::LogLevel levels[] = { mitsuba::LogLevel::Error, Info, Debug, Trace };
        logger()->set_log_level(levels[std::min(verbosity, 3u)]);
        jit_set_log_level_stderr(verbosity > 1 ? ::LogLevel::Warn : ::LogLevel::Error);
        render_threads = threads;
        // Plugins are also made apart from any scene.
        set_file_resolver(new_resolver());
        start_backend(variant);
        Profiler::static_initialization();
        color_management_static_initialization(string::starts_with(variant, "cuda_"),
                                               string::starts_with(variant, "llvm_"), false);
        MI_INVOKE_VARIANT(variant, start_acceleration);
        vpt::install();
    });
}

int32_t vpt_scene_load(const char *variant, const char *path, const VptSceneFile *file, void **out, char *error,
                       size_t size) {
    return guarded(error, size, [&] {
        auto scene = std::make_unique<LoadedScene>();
        scene->variant = variant;
        scene->root = instantiate(variant, path, *file, scene->notes);
        *out = scene.release();
    });
}

void vpt_scene_free(void *scene) { delete static_cast<LoadedScene *>(scene); }

const char *vpt_scene_notes(void *scene) { return static_cast<LoadedScene *>(scene)->notes.c_str(); }

int32_t vpt_scene_facts(void *scene_, uint32_t *sensors, uint32_t *emitters, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        *sensors = MI_INVOKE_VARIANT(scene->variant, sensor_count, scene->root.get());
        *emitters = MI_INVOKE_VARIANT(scene->variant, emitter_count, scene->root.get());
    });
}

int32_t vpt_scene_film_size(void *scene_, uint32_t sensor, uint32_t *out, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        MI_INVOKE_VARIANT(scene->variant, film_size, scene->root.get(), sensor, out);
    });
}

int32_t vpt_scene_render(void *scene_, uint32_t sensor, uint32_t seed, uint32_t passes, const VptObserver *observer,
                         char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        struct Embedding {
            explicit Embedding(const VptObserver *observer) { vpt::embedding_observer() = observer; }
            ~Embedding() { vpt::embedding_observer() = nullptr; }
        } embedding(observer);
        ScopedThreads threads;
        MI_INVOKE_VARIANT(scene->variant, render, scene->root.get(), sensor, seed, passes);
    });
}

int32_t vpt_scene_write(void *scene_, uint32_t sensor, const char *path, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        MI_INVOKE_VARIANT(scene->variant, write, scene->root.get(), sensor, fs::path(path));
    });
}

int32_t vpt_scene_describe_film(void *scene_, uint32_t sensor, char *says, char *others, size_t text_size,
                                uint32_t *has_alpha, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        std::string of_film, names;
        MI_INVOKE_VARIANT(scene->variant, describe_film, scene->root.get(), sensor, of_film, names, *has_alpha);
        copy_text(of_film, says, text_size);
        copy_text(names, others, text_size);
    });
}

int32_t vpt_scene_read_film(void *scene_, uint32_t sensor, float *out, size_t values, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        MI_INVOKE_VARIANT(scene->variant, read_film, scene->root.get(), sensor, out, values);
    });
}

const char *vpt_mitsuba_version() { return MI_VERSION; }

int32_t vpt_scene_read_rgb(void *scene_, uint32_t sensor, float *out, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        MI_INVOKE_VARIANT(scene->variant, read_rgb, scene->root.get(), sensor, out);
    });
}

int32_t vpt_scene_lend(void *scene_, uint32_t sensor, VptHost *out, void **owner, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        auto lent = vpt::variant(scene->variant).lend(scene->root.get(), sensor, out);
        *owner = new Lent{ {}, lent };
    });
}

// The strings live as long as the scene does.
int32_t vpt_scene_parameters(void *scene_, uint32_t sensor, VptParameters *out, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        vpt::variant(scene->variant).parameters(scene->root.get(), sensor, out);
    });
}

int32_t vpt_integrator_create(const char *variant_, const char *name, int64_t max_depth, int64_t rr_depth,
                              uint32_t hide_emitters, void **out, char *error, size_t size) {
    return guarded(error, size, [&] {
        std::string variant(variant_);
        Properties props(name);
        props.set("max_depth", max_depth);
        props.set("rr_depth", rr_depth);
        props.set("hide_emitters", hide_emitters != 0);
        auto own = std::make_unique<OwnIntegrator>();
        MI_INVOKE_VARIANT(variant, create_integrator, props, own->integrator);
        *out = own.release();
    });
}

void vpt_integrator_free(void *integrator) { delete static_cast<OwnIntegrator *>(integrator); }

uint32_t vpt_integrator_known(const char *name) {
    try {
        return PluginManager::instance()->plugin_type(name) == ObjectType::Integrator;
    } catch (const std::exception &) {
        return 0;
    }
}

int32_t vpt_scene_render_with(void *scene_, void *integrator_, uint32_t sensor, uint32_t seed, uint32_t *spp,
                              float *rgb, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *scene = static_cast<LoadedScene *>(scene_);
        Object *root = scene->root.get(), *integrator = static_cast<OwnIntegrator *>(integrator_)->integrator.get();
        *spp = MI_INVOKE_VARIANT(scene->variant, render_with, root, integrator, sensor, seed, *spp);
        MI_INVOKE_VARIANT(scene->variant, read_rgb, root, sensor, rgb);
    });
}

void vpt_scene_give_back(void *owner) { delete static_cast<Lent *>(owner); }

int32_t vpt_scene_bare_walks(void *scene_, uint32_t sensor, uint64_t walks, uint32_t max_depth, uint32_t rr_depth,
                             uint64_t *vertices, char *error, size_t size) {
    return guarded(error, size, [&] {
        auto *loaded = static_cast<LoadedScene *>(scene_);
        using Rgb = Color<float, 3>;
        auto *scene = as_scene<float, Rgb>(loaded->root.get());
        if (!scene)
            Throw("bare walks need the variant scalar_rgb, but the scene was loaded in \"%s\"", loaded->variant);
        vpt::SceneTables<float, Rgb> tables(scene, scene->sensors()[sensor].get());
        dr::scoped_flush_denormals flushes(true); // as the seam does
        *vertices = vpt::bare_walks(scene, tables, walks, max_depth, rr_depth);
    });
}

}
