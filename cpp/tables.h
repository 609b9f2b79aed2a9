// What is known of a scene before rendering: its media, numbered for the engine; which BSDFs are plain
// Lambertian reflectors; and in which medium each emitter's light starts.
#pragma once

#include "band.h"
#include "emission.h"
#include "frozen.h"
#include "lamps.h"
#include "vpt.h"

#include <optional>
#include <string>
#include <unordered_set>

namespace vpt {

template <typename Float, typename Spectrum> class SceneTables {
public:
    MI_IMPORT_TYPES(Scene, Sensor, Shape, ShapePtr, BSDF, BSDFPtr, Medium, MediumPtr, Emitter,
                    EmitterPtr, PhaseFunction, Volume)
    static constexpr bool Jit = dr::is_jit_v<Float>;
    using Channels = Band<Float, Spectrum>;

    SceneTables(Scene *scene, Sensor *sensor)
        : m_scene(scene), m_sensor(sensor), m_lamps(scene), m_shapes(shapes_of(scene)) {
        if constexpr (Channels::Spectral)
            m_emission.emplace(scene, m_lamps.all());
        visit(scene);
        collect_media();
        collect_bsdfs();
        collect_emitters();
        collect_surfaces();
        m_sensor_name = keep_name(*sensor);
    }

    // Where channels are wavelengths, constants are the largest of all light's.
    const std::vector<VptMedium> &media() const { return m_descriptions; }

    // The same with the constants of these wavelengths.
    std::vector<VptMedium> media(const Wavelength &wavelengths) const {
        std::vector<VptMedium> out = m_descriptions;
        for (size_t i = 0; i < out.size(); ++i)
            if (!out[i].varying)
                put_constants(m_media[i], wavelengths, out[i]);
        return out;
    }

    const std::vector<VptSurface> &surfaces() const { return m_surfaces; }
    const std::vector<VptEmitter> &emitters() const { return m_emitters; }
    const Lamps<Float, Spectrum> &lamps() const { return m_lamps; }
    const char *sensor_name() const { return m_sensor_name; }
    const std::vector<std::string> &warnings() const { return m_warnings; }

    // What lamps emit at given wavelengths, in spectral variants.
    const Emission<Float, Spectrum> &emission() const { return *m_emission; }

    // Runs a program over this scene or, where Dr.Jit has recorded it, replays it. See FrozenPrograms::run.
    template <typename Inputs, typename Outputs, typename Program>
    void run(const ProgramKey &which, const Inputs &inputs, Outputs &&outputs, Program &&program) const {
        if constexpr (Jit)
            m_programs.run(which, inputs, outputs, [this] { return variables(); }, program);
        else
            program();
    }

    // Does any medium scatter by a microflake distribution?
    bool has_microflakes() const { return m_has_microflakes; }

    // The engine's number of a medium.
    UInt32 medium_index(const MediumPtr &medium) const {
        if constexpr (Jit) {
            return dr::gather<UInt32>(m_index_by_id, dr::reinterpret_array<UInt32>(medium));
        } else {
            for (size_t i = 0; i < m_media.size(); ++i)
                if (m_media[i] == medium)
                    return (uint32_t) i;
            return VPT_VACUUM;
        }
    }

    MediumPtr medium(const UInt32 &index, const Mask &active) const {
        if constexpr (Jit)
            return m_media.empty() ? dr::zeros<MediumPtr>(dr::width(index))
                                   : dr::gather<MediumPtr>(m_media_dr, index, active && index != VPT_VACUUM);
        else
            return active && index != VPT_VACUUM ? m_media[index] : nullptr;
    }

    // Is the smooth part of this BSDF a Lambertian reflector and nothing else?
    Mask is_lambertian(const BSDFPtr &bsdf, const Mask &active) const {
        if constexpr (Jit) {
            return dr::gather<UInt32>(m_lambertian_by_id, dr::reinterpret_array<UInt32>(bsdf), active) != 0;
        } else {
            for (const BSDF *known : m_lambertian)
                if (known == bsdf)
                    return active;
            return false;
        }
    }

    // The medium in which light leaves an emitter, and whether any of it arrives anywhere.
    std::pair<MediumPtr, Mask> emitter_medium(const EmitterPtr &emitter, const Mask &active) const {
        if constexpr (Jit) {
            UInt32 id = dr::reinterpret_array<UInt32>(emitter);
            return { dr::gather<MediumPtr>(m_emitter_media_dr, id, active),
                     dr::gather<UInt32>(m_emitter_lit, id, active) != 0 };
        } else {
            for (size_t i = 0; i < m_lamps.all().size(); ++i)
                if (m_lamps.all()[i] == emitter)
                    return { m_emitter_media[i], m_emitter_shines[i] };
            return { nullptr, false };
        }
    }

    // How densely the light of a lamp lies in directions at a distance from it: as Mitsuba samples those of skies, and as an area
    // is seen; infinitely where a lamp has none. [Glossy chain]
    Float lamp_density(const EmitterPtr &emitter, const Vector3f &to_lamp, const Float &distance, const Mask &active) const {
        return lamp_density_from(lamp_density_at_first(emitter, to_lamp, active), distance);
    }

    // The same while the distance is not known: areas are negative and as seen from a distance of 1.
    Float lamp_density_at_first(const EmitterPtr &emitter, const Vector3f &to_lamp, const Mask &active) const {
        Float density = constant_density(emitter, active);
        Mask sky = active && density == 0.f;
        if (dr::any_or<true>(sky)) {
            DirectionSample3f ds = dr::zeros<DirectionSample3f>(dr::width(to_lamp));
            ds.d = to_lamp;
            dr::masked(density, sky) = emitter->pdf_direction(dr::zeros<Interaction3f>(dr::width(to_lamp)), ds, sky);
        }
        return density;
    }

    static Float lamp_density_from(const Float &at_first, const Float &distance) {
        return dr::select(at_first < 0.f, -at_first * dr::square(distance), at_first);
    }

private:
    // Of areas, as above, and of lamps without any; 0 of skies.
    Float constant_density(const EmitterPtr &emitter, const Mask &active) const {
        if constexpr (Jit) {
            return dr::gather<Float>(m_emitter_densities_dr, dr::reinterpret_array<UInt32>(emitter), active);
        } else {
            for (size_t i = 0; active && i < m_lamps.all().size(); ++i)
                if (m_lamps.all()[i] == emitter)
                    return m_emitter_densities[i];
            return 0.f;
        }
    }

    static float constant_density(const Emitter *emitter) {
        if (has_flag(emitter->flags(), EmitterFlags::Delta))
            return dr::Infinity<float>;
        return emitter->shape() ? -1.f / (float) plain(Float(emitter->shape()->surface_area())) : 0.f;
    }

    // All variables of Dr.Jit that programs over this scene may read: those of everything that takes virtual calls, of whatever
    // scene it is part of, and those of the scene and of these tables.
    std::vector<uint32_t> variables() const {
        std::vector<uint32_t> out;
        dr::scoped_set_flag traversal(JitFlag::EnableObjectTraversal, true);
        auto add = [&out](const auto &value) {
            auto more = variables_of(value);
            out.insert(out.end(), more.begin(), more.end());
        };
        add(dr::tie(m_index_by_id, m_lambertian_by_id, m_emitter_lit, m_emitter_densities_dr, m_media_dr,
                    m_emitter_media_dr));
        const dr::TraversableBase *scene = m_scene, *sensor = m_sensor;
        add(scene);
        add(sensor);
        add(m_lamps);
        if (m_emission)
            add(*m_emission);
        for (const char *domain : { "Shape", "BSDF", "Emitter", "Sensor", "Medium", "PhaseFunction", "Phase", "Texture", "Volume" }) {
            std::vector<void *> objects(jit_registry_id_bound(Scene::Variant, domain), nullptr);
            jit_registry_get_pointers(Scene::Variant, domain, objects.data());
            for (void *object : objects)
                if (object)
                    add((const dr::TraversableBase *) object);
        }
        return out;
    }

    // Every object of the scene, those inside shape groups too.
    void visit(Object *object) {
        if (!object || !m_visited.insert(object).second)
            return;
        for (auto &part : NamedParts(object).objects)
            visit(part.second);
        if (auto *shape = dynamic_cast<Shape *>(object)) {
            visit(const_cast<Medium *>(shape->interior_medium()));
            visit(const_cast<Medium *>(shape->exterior_medium()));
        }
    }

    static std::vector<Shape *> shapes_of(Scene *scene) {
        std::vector<Shape *> shapes;
        for (auto &shape : scene->shapes())
            shapes.push_back(shape.get());
        return in_order<Shape, Shape>(shapes, [](const Shape *shape) { return shape; });
    }

    template <typename T> std::vector<T *> all_of() const {
        std::vector<T *> found;
        for (Object *object : m_visited)
            if (auto *match = dynamic_cast<T *>(object))
                found.push_back(match);
        return found;
    }

    void add_medium(const Medium *medium) {
        if (!medium || std::find(m_media.begin(), m_media.end(), medium) != m_media.end())
            return;
        m_has_microflakes |= has_flag(medium->phase_function()->get_flags(), PhaseFunctionFlags::Microflake);
        m_media.push_back(medium);
        m_descriptions.push_back(describe(const_cast<Medium *>(medium), keep_name(*medium)));
    }

    // What the scene calls an object, or else its kind; the text lives as long as the tables.
    const char *keep_name(const Object &object) {
        m_names.push_back(std::make_unique<std::string>(object.id().empty() ? object.class_name() : object.id()));
        return m_names.back()->c_str();
    }

    void collect_media() {
        add_medium(m_sensor->medium());
        for (Shape *shape : m_shapes) {
            add_medium(shape->interior_medium());
            add_medium(shape->exterior_medium());
        }
        for (Emitter *emitter : m_lamps.all())
            add_medium(emitter->medium());
        std::vector<Medium *> nested = all_of<Medium>();
        std::sort(nested.begin(), nested.end(), [](Medium *a, Medium *b) { return a->id() < b->id(); });
        for (const Medium *medium : nested)
            add_medium(medium);
        if constexpr (Jit) {
            std::vector<uint32_t> index_by_id(registry_bound("Medium"), VPT_VACUUM);
            for (size_t i = 0; i < m_media.size(); ++i)
                index_by_id[jit_registry_id(m_media[i])] = (uint32_t) i;
            m_index_by_id = dr::load<UInt32>(index_by_id.data(), index_by_id.size());
            m_media_dr = dr::load<DynamicBuffer<MediumPtr>>(m_media.data(), m_media.size());
            dr::eval(m_index_by_id, m_media_dr);
        }
    }

    static size_t registry_bound(const char *domain) {
        return jit_registry_id_bound(Scene::Variant, domain) + 1;
    }

    VptMedium describe(Medium *medium, const char *name) const {
        VptMedium out{};
        out.name = name;
        const PhaseFunction *phase = medium->phase_function();
        bool directional = has_flag(phase->get_flags(), PhaseFunctionFlags::Microflake);
        out.varying = directional || !medium->is_homogeneous();
        describe_phase(const_cast<PhaseFunction *>(phase), out);
        describe_bounds(medium, out);
        out.grey = is_grey(medium);
        Volume *albedo = volume(medium, "albedo");
        out.varying_scattering = (out.varying || !is_constant(albedo)) && !is_black(albedo);
        if (out.varying)
            return out;
        if constexpr (Channels::Spectral) {
            auto [most_t, most_s] = std::pair(range([&](const auto &mei) { return medium->get_majorant(mei, true); }).second,
                                              range([&](const auto &mei) { return sigma_s(medium, mei); }).second);
            for (size_t i = 0; i < 3; ++i)
                std::tie(out.sigma_t[i], out.sigma_s[i]) = std::pair(most_t, most_s);
        } else {
            put_constants(medium, Channels::all_light()[0], out);
        }
        return out;
    }

    static void put_constants(const Medium *medium, const Wavelength &wavelengths, VptMedium &out) {
        MediumInteraction3f mei = somewhere(wavelengths);
        auto extinction = Channels::channels(medium->get_majorant(mei, true)),
             scattering = Channels::channels(sigma_s(medium, mei));
        for (size_t i = 0; i < 3; ++i) {
            out.sigma_t[i] = plain(Float(extinction[i]));
            out.sigma_s[i] = plain(Float(scattering[i]));
        }
    }

    static UnpolarizedSpectrum sigma_s(const Medium *medium, const MediumInteraction3f &mei) {
        return std::get<0>(medium->get_scattering_coefficients(mei, true));
    }

    static MediumInteraction3f somewhere(const Wavelength &wavelengths) {
        MediumInteraction3f mei = dr::zeros<MediumInteraction3f>();
        mei.wi = Vector3f(0.f, 0.f, 1.f);
        mei.wavelengths = wavelengths;
        return mei;
    }

    // The least and the largest value of all light.
    template <typename Value> static std::pair<float, float> range(Value &&value_at) {
        float least = dr::Infinity<float>, most = -dr::Infinity<float>;
        for (const Wavelength &wavelengths : Channels::all_light()) {
            UnpolarizedSpectrum value = value_at(somewhere(wavelengths));
            Float low = dr::min(value), high = dr::max(value);
            if constexpr (Jit) {
                low = dr::min(low);
                high = dr::max(high);
            }
            least = std::min(least, plain(low));
            most = std::max(most, plain(high));
        }
        return { least, most };
    }

    static Volume *volume(Medium *medium, const char *name) {
        return dynamic_cast<Volume *>(NamedParts(medium).object(name));
    }

    // A value that Mitsuba wraps as a volume, as it does plain numbers and colours.
    static bool is_constant(Volume *volume) { return volume && volume->class_name() == "ConstVolume"; }

    static bool is_black(Volume *volume) {
        return is_constant(volume) && range_of(volume) == std::pair(0.f, 0.f);
    }

    // A volume of one channel is grey, and so is a constant one that looks it. Of other media Mitsuba
    // knows what their author says.
    static bool is_grey(Medium *medium) {
        Volume *sigma_t = volume(medium, "sigma_t");
        if (sigma_t && sigma_t->channel_count() == 1)
            return true;
        if (!is_constant(sigma_t))
            return !medium->has_spectral_extinction();
        auto [least, most] = range_of(sigma_t);
        return least == most;
    }

    static std::pair<float, float> range_of(const Volume *volume) {
        return range([volume](const auto &mei) { return volume->eval(mei, true); });
    }

    static void describe_phase(PhaseFunction *phase, VptMedium &out) {
        out.phase = VPT_PHASE_OPAQUE;
        if (phase->class_name() == "IsotropicPhaseFunction") {
            out.phase = VPT_PHASE_ISOTROPIC;
        } else if (phase->class_name() == "HGPhaseFunction") {
            if (const Float *g = NamedParts(phase).value<Float>("g")) {
                out.phase = VPT_PHASE_HENYEY_GREENSTEIN;
                out.g = plain(*g);
            }
        }
    }

    // The box of the extinction's grid, and its voxel size as the scale on which it varies.
    static void describe_bounds(Medium *medium, VptMedium &out) {
        for (size_t i = 0; i < 3; ++i) {
            out.bounds_min[i] = -dr::Infinity<float>;
            out.bounds_max[i] = dr::Infinity<float>;
        }
        out.feature_size = dr::Infinity<float>;
        if (Volume *sigma_t = volume(medium, "sigma_t"); sigma_t && !medium->is_homogeneous()) {
            auto box = sigma_t->bbox();
            auto resolution = sigma_t->resolution();
            for (size_t i = 0; i < 3; ++i) {
                out.bounds_min[i] = box.min[i];
                out.bounds_max[i] = box.max[i];
                float voxel = (box.max[i] - box.min[i]) / (float) std::max(1, (int) resolution[i]);
                out.feature_size = std::min(out.feature_size, voxel);
            }
        }
    }

    static bool lambertian(Object *bsdf) {
        if (bsdf->class_name() == "SmoothDiffuse")
            return true;
        if (bsdf->class_name() != "TwoSidedBRDF")
            return false;
        NamedParts parts(bsdf);
        for (auto &part : parts.objects)
            if (part.second && !lambertian(part.second))
                return false;
        return !parts.objects.empty();
    }

    void collect_bsdfs() {
        for (BSDF *bsdf : all_of<BSDF>())
            if (lambertian(bsdf))
                m_lambertian.push_back(bsdf);
        if constexpr (Jit) {
            std::vector<uint32_t> by_id(registry_bound("BSDF"), 0);
            for (const BSDF *bsdf : m_lambertian)
                by_id[jit_registry_id(bsdf)] = 1;
            m_lambertian_by_id = dr::load<UInt32>(by_id.data(), by_id.size());
            dr::eval(m_lambertian_by_id);
        }
    }

    // Shapes that carry a material, those inside shape groups too, in an order that the scene decides.
    void collect_surfaces() {
        std::vector<const Shape *> shapes(m_shapes.begin(), m_shapes.end());
        std::vector<Shape *> nested = all_of<Shape>();
        std::sort(nested.begin(), nested.end(), [](Shape *a, Shape *b) { return a->id() < b->id(); });
        for (const Shape *shape : nested)
            if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end())
                shapes.push_back(shape);
        for (const Shape *shape : shapes)
            if (shape->bsdf() && !shape->is_sensor())
                m_surfaces.push_back({ keep_name(*shape), lobes(shape->bsdf()), number(shape->interior_medium()),
                                       number(shape->exterior_medium()) });
    }

    static uint32_t lobes(const BSDF *bsdf) {
        uint32_t flags = plain(UInt32(bsdf->flags())), out = 0;
        auto add = [&](BSDFFlags lobe, uint32_t bit) { out |= has_flag(flags, lobe) ? bit : 0u; };
        add(BSDFFlags::Smooth, VPT_LOBE_SMOOTH);
        add(BSDFFlags::DeltaReflection, VPT_LOBE_DELTA_REFLECTION);
        add(BSDFFlags::DeltaTransmission, VPT_LOBE_DELTA_TRANSMISSION);
        add(BSDFFlags::Null, VPT_LOBE_NULL);
        add(BSDFFlags::Glossy, VPT_LOBE_GLOSSY);
        add(BSDFFlags::GlossyTransmission, VPT_LOBE_GLOSSY_TRANSMISSION);
        return out;
    }

    // The engine's number of a medium.
    uint32_t number(const Medium *medium) const {
        auto found = std::find(m_media.begin(), m_media.end(), medium);
        return found == m_media.end() ? VPT_VACUUM : (uint32_t) (found - m_media.begin());
    }

    void collect_emitters() {
        for (Emitter *emitter : m_lamps.all()) {
            bool is_environment = emitter->is_environment();
            auto bounds = emitter->bbox();
            bool near = !has_flag(emitter->flags(), EmitterFlags::Infinite) && bounds.valid();
            auto centre = near ? bounds.center() : ScalarPoint3f(0.f);
            m_emitters.push_back({ keep_name(*emitter), emitter->shape() || is_environment, is_environment,
                                   { centre.x(), centre.y(), centre.z() },
                                   near ? .5f * dr::norm(bounds.extents()) : -1.f });
            const Medium *medium = medium_around(emitter);
            bool infinite = has_flag(emitter->flags(), EmitterFlags::Infinite);
            bool shines =
                !(infinite && medium && medium->is_homogeneous() && extinguishes(medium));
            if (!shines)
                m_warnings.push_back(tfm::format(
                    "the emitter \"%s\" is infinitely far away inside the unbounded medium \"%s\", which "
                    "absorbs all of its light; bound the medium with a shape that names it as interior",
                    emitter->id(), medium->id()));
            m_emitter_media.push_back(medium);
            m_emitter_densities.push_back(constant_density(emitter));
            m_emitter_shines.push_back(shines);
        }
        if constexpr (Jit) {
            size_t bound = registry_bound("Emitter");
            std::vector<const Medium *> media(bound, nullptr);
            std::vector<uint32_t> lit(bound, 0);
            std::vector<float> densities(bound, 0.f);
            for (size_t i = 0; i < m_emitter_media.size(); ++i) {
                uint32_t id = jit_registry_id(m_lamps.all()[i]);
                media[id] = m_emitter_media[i];
                lit[id] = m_emitter_shines[i];
                densities[id] = m_emitter_densities[i];
            }
            m_emitter_media_dr = dr::load<DynamicBuffer<MediumPtr>>(media.data(), bound);
            m_emitter_lit = dr::load<UInt32>(lit.data(), bound);
            m_emitter_densities_dr = dr::load<Float>(densities.data(), bound);
            dr::eval(m_emitter_media_dr, m_emitter_lit, m_emitter_densities_dr);
        }
    }

    // Whether a homogeneous medium takes anything away; one without extinction is as good as none.
    static bool extinguishes(const Medium *medium) {
        return range([medium](const auto &mei) { return medium->get_majorant(mei, true); }).second > 0.f;
    }

    // What the scene says of the emitter's surroundings or, where it says nothing, what a straight way
    // from the emitter to the sensor meets.
    const Medium *medium_around(Emitter *emitter) {
        if (const Shape *shape = emitter->shape(); shape && shape->is_medium_transition())
            return shape->exterior_medium();
        if (emitter->medium())
            return emitter->medium();
        auto center = m_scene->bbox().center();
        auto eye = ScalarPoint3f(0.f);
        for (size_t i = 0; i < 3; ++i)
            eye[i] = plain(Float((m_sensor->world_transform() * Point3f(0.f))[i]));
        if (has_flag(emitter->flags(), EmitterFlags::Infinite)) {
            auto extent = m_scene->bbox().extents();
            float far = 4.f * (dr::norm(extent) + dr::norm(center - eye)) + 1.f;
            return medium_toward(center + ScalarVector3f(0.31f, 0.47f, 0.83f) * far, eye);
        }
        auto [ps, weight] = emitter->sample_position(0.f, Point2f(0.4142f, 0.7321f));
        ScalarPoint3f start;
        for (size_t i = 0; i < 3; ++i)
            start[i] = plain(Float(ps.p[i]));
        if (emitter->shape())
            for (size_t i = 0; i < 3; ++i)
                start[i] += plain(Float(ps.n[i])) * 1e-4f * (1.f + dr::max(dr::abs(start)));
        return medium_toward(start, eye);
    }

    // The medium at `from`: that on the near side of the first boundary on the way to `eye`, or the
    // sensor's own where there is none.
    const Medium *medium_toward(ScalarPoint3f from, ScalarPoint3f eye) {
        for (int crossings = 0; crossings < 1000; ++crossings) {
            ScalarVector3f d = eye - from;
            float distance = dr::norm(d);
            if (!(distance > 0.f))
                break;
            d /= distance;
            Ray3f ray = dr::zeros<Ray3f>();
            ray.o = Point3f(from);
            ray.d = Vector3f(d);
            ray.maxt = distance;
            SurfaceInteraction3f si = m_scene->ray_intersect(ray, true);
            if (!plain(Mask(si.is_valid())))
                break;
            const Shape *shape = shape_of(si.shape);
            float cosine = plain(Float(dr::dot(si.n, ray.d)));
            if (shape->is_medium_transition())
                return cosine < 0.f ? shape->exterior_medium() : shape->interior_medium();
            for (size_t i = 0; i < 3; ++i)
                from[i] = plain(Float(si.spawn_ray(ray.d).o[i]));
        }
        return m_sensor->medium();
    }

    static const Shape *shape_of(const ShapePtr &shape) {
        if constexpr (Jit)
            return (const Shape *) jit_registry_ptr(
                Scene::Variant, Shape::Domain, dr::reinterpret_array<UInt32>(shape).entry(0));
        else
            return shape;
    }

    bool m_has_microflakes = false;
    std::unordered_set<Object *> m_visited;
    Scene *m_scene;
    Sensor *m_sensor;
    Lamps<Float, Spectrum> m_lamps;
    std::vector<Shape *> m_shapes;
    std::vector<const Medium *> m_media;
    std::vector<std::unique_ptr<std::string>> m_names;
    std::vector<VptMedium> m_descriptions;
    std::vector<VptSurface> m_surfaces;
    std::vector<VptEmitter> m_emitters;
    const char *m_sensor_name;
    std::optional<Emission<Float, Spectrum>> m_emission;
    std::vector<const BSDF *> m_lambertian;
    std::vector<const Medium *> m_emitter_media;
    std::vector<bool> m_emitter_shines;
    std::vector<float> m_emitter_densities;
    std::vector<std::string> m_warnings;
    UInt32 m_index_by_id, m_lambertian_by_id, m_emitter_lit;
    Float m_emitter_densities_dr;
    DynamicBuffer<MediumPtr> m_media_dr, m_emitter_media_dr;
    mutable std::conditional_t<Jit, FrozenPrograms<Float>, std::nullptr_t> m_programs{};
};

}
