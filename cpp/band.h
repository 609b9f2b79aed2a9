// What the engine's three channels are in a variant: red, green and blue; three wavelengths that all view rays and photons that
// meet share; or one value three times. [Shared wavelengths]
#pragma once

#include "lanes.h"

#include <mitsuba/core/spectrum.h>

#include <vector>

namespace vpt {

template <typename Float, typename Spectrum> class Band {
public:
    MI_IMPORT_TYPES(Sensor)
    static constexpr bool Spectral = is_spectral_v<Spectrum>, Jit = dr::is_jit_v<Float>;

    // The wavelengths that a number in [0,1) chooses: it and its shifts by thirds go through the sensor's own sampling, whose
    // weights, a response function among them, are part of the channels' colours.
    Band(const Sensor *sensor, float number) {
        if constexpr (Spectral) {
            auto si = dr::zeros<SurfaceInteraction3f>();
            for (size_t channel = 0; channel < 3; ++channel) {
                float shifted = number + (float) channel / 3.f;
                auto [wavelengths, weights] =
                    sensor->sample_wavelengths(si, dr::opaque<Float>(shifted < 1.f ? shifted : shifted - 1.f), true);
                auto rgb = linear_rgb_rec(Float(wavelengths[0])) * Float(weights[0]);
                m_wavelengths[channel] = dr::opaque<Float>(plain(Float(wavelengths[0])));
                for (size_t i = 0; i < 3; ++i)
                    m_colours[channel][i] = plain(Float(rgb[i])) * (float) (MI_CIE_Y_NORMALIZATION / 3.0);
            }
            m_wavelengths[3] = m_wavelengths[0];
            m_number = dr::opaque<Float>(number);
            m_sensor_weight = dr::opaque<Float>(plain(Float(dr::max(sensor->sample_wavelengths(si, m_number, true).second))));
        } else {
            DRJIT_MARK_USED(sensor);
            DRJIT_MARK_USED(number);
        }
    }

    // What programs read of it.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro callback) const {
        dr::traverse_1_fn_ro(dr::tie(m_wavelengths, m_number, m_sensor_weight), payload, callback);
    }

    // What a unit of a channel adds to red, green and blue of the film.
    const float *colours(size_t channel) const { return m_colours[channel]; }

    // In the order of the channels; a fourth lane repeats the first.
    Wavelength wavelengths(size_t lanes) const {
        if constexpr (Spectral && Jit)
            return m_wavelengths + dr::zeros<Wavelength>(lanes);
        else
            return m_wavelengths;
    }

    // The hero's wavelength first, the others after it: Mitsuba's media sample distances by their first wavelength.
    Wavelength wavelengths_of(const UInt32 &hero) const {
        Wavelength out;
        for (size_t lane = 0; lane < dr::size_v<Wavelength>; ++lane)
            out[lane] = dr::select(hero == 0u, m_wavelengths[lane % 3],
                                   dr::select(hero == 1u, m_wavelengths[(lane + 1) % 3], m_wavelengths[(lane + 2) % 3]));
        return out;
    }

    // The three channels of a value at `wavelengths`.
    static Color<Float, 3> channels(const UnpolarizedSpectrum &value) {
        if constexpr (is_monochromatic_v<Spectrum>)
            return Color<Float, 3>(value[0]);
        else
            return Color<Float, 3>(value[0], value[1], value[2]);
    }

    // The three channels of a value at `wavelengths_of(hero)`.
    static Color<Float, 3> channels(const UnpolarizedSpectrum &value, const UInt32 &hero) {
        if constexpr (Spectral)
            return Color<Float, 3>(dr::select(hero == 0u, value[0], dr::select(hero == 1u, value[2], value[1])),
                                   dr::select(hero == 0u, value[1], dr::select(hero == 1u, value[0], value[2])),
                                   dr::select(hero == 0u, value[2], dr::select(hero == 1u, value[1], value[0])));
        else
            return channels(value);
    }

    // A value of a walk in the channel that its hero names.
    static Float of_hero(const UnpolarizedSpectrum &value, const UInt32 &hero) {
        Float result = value[0];
        if constexpr (is_rgb_v<Spectrum>) {
            dr::masked(result, hero == 1u) = value[1];
            dr::masked(result, hero == 2u) = value[2];
        }
        return result;
    }

    // Over the channels.
    static Float mean(const UnpolarizedSpectrum &value) {
        if constexpr (Spectral)
            return (value[0] + value[1] + value[2]) * (1.f / 3.f);
        else
            return dr::mean(value);
    }

    // The number for the sensor's own sampling of wavelengths.
    Float number() const { return m_number; }

    // What is left of a sensor's weight without that sampling's.
    UnpolarizedSpectrum importance(const UnpolarizedSpectrum &weight) const {
        if constexpr (Spectral)
            return UnpolarizedSpectrum(dr::max(weight) / m_sensor_weight);
        else
            return weight;
    }

    // Wavelengths [nm] by which facts are told that must hold for all light, 1 apart; one empty set where there are none.
    static std::vector<Wavelength> all_light() {
        constexpr size_t Sets = 117;
        std::vector<Wavelength> sets(Spectral && !Jit ? Sets : 1);
        for (size_t set = 0; set < sets.size(); ++set)
            for (size_t lane = 0; lane < dr::size_v<Wavelength>; ++lane) {
                if constexpr (Jit)
                    sets[set][lane] = 4.f * dr::arange<Float>(Sets) + (360.f + (float) lane);
                else
                    sets[set][lane] = 360.f + (float) (4 * set + lane);
            }
        return sets;
    }

private:
    Wavelength m_wavelengths;
    Float m_number = 0.f, m_sensor_weight = 1.f;
    float m_colours[3][3] = {};
};

}
