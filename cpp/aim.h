// Where on the film places on lamps would be seen if nothing were in the way: what is smaller than a pixel is looked for there.
// [Emission rays]
#pragma once

#include "tables.h"

namespace vpt {

template <typename Float, typename Spectrum> class Aim {
public:
    MI_IMPORT_TYPES(Scene, Sensor, Film, EmitterPtr)
    using Tables = SceneTables<Float, Spectrum>;
    using Channels = Band<Float, Spectrum>;

    Aim(const Sensor *sensor, const Tables &tables, const Channels &band)
        : m_sensor(sensor), m_tables(tables), m_band(band) {}

    // Whether the sensor tells where a place is seen.
    bool is_possible() const {
        Interaction3f somewhere = dr::zeros<Interaction3f>();
        somewhere.wavelengths = m_band.wavelengths(1);
        try {
            m_sensor->sample_direction(somewhere, Point2f(.5f), true);
            return true;
        } catch (const std::exception &) { // Mitsuba has no other way to say that it is not implemented
            return false;
        }
    }

    // In film coordinates; not a number where the lamp has no extent or is not on the film.
    Point2f sample(const Float &lamp, const Point2f &place) const { return seen_at(place_on_lamp(lamp, place)); }

private:
    Interaction3f place_on_lamp(const Float &lamp, const Point2f &place) const {
        Interaction3f eye = dr::zeros<Interaction3f>(dr::width(lamp));
        eye.p = m_sensor->world_transform() * Point3f(0.f);
        eye.time = m_sensor->shutter_open();
        eye.wavelengths = m_band.wavelengths(dr::width(lamp));
        auto [emitter, inverse_probability, again] = m_tables.lamps().choose(lamp, true);
        UInt32 flags = emitter->flags(true);
        Mask extends = !has_flag(flags, EmitterFlags::Delta), sky = extends && has_flag(flags, EmitterFlags::Infinite),
             surface = extends && !sky;
        Interaction3f out = eye;
        out.p = Point3f(dr::NaN<Float>);
        if (dr::any_or<true>(sky)) {
            auto [ds, value] = emitter->sample_direction(eye, place, sky);
            dr::masked(out.p, sky) = eye.p + ds.d * sky_distance();
        }
        // By area: what lies behind is seen at the same places, and Mitsuba's directions to spheres fail where those are small.
        if (dr::any_or<true>(surface))
            dr::masked(out.p, surface) = emitter->sample_position(eye.time, place, surface).first.p;
        return out;
    }

    Point2f seen_at(const Interaction3f &place) const {
        auto [ds, importance] = m_sensor->sample_direction(place, Point2f(.5f), true);
        Mask on_film = ds.pdf > 0.f && dr::all(dr::isfinite(ds.uv));
        return dr::select(on_film, ds.uv + ScalarVector2f(m_sensor->film()->crop_offset()), Point2f(dr::NaN<Float>));
    }

    // Between the planes that cut off what a camera sees.
    float sky_distance() const {
        auto *camera = dynamic_cast<const ProjectiveCamera<Float, Spectrum> *>(m_sensor);
        return camera ? .5f * (camera->near_clip() + camera->far_clip()) : 1.f;
    }

    const Sensor *m_sensor;
    const Tables &m_tables;
    const Channels &m_band;
};

}
