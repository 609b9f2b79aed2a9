// C ABI of the vpt engine. Written by cbindgen from src/host; `just bless` renews it.

#pragma once

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

typedef struct VptStats VptStats;
typedef struct VptFilm VptFilm;

// Raised whenever a struct or a meaning on this page changes.
#define VPT_ABI_VERSION 11

// "No medium" in arrays of medium indices.
#define VPT_VACUUM UINT32_MAX

// Phase functions that the engine can evaluate by itself.
#define VPT_PHASE_ISOTROPIC 0

#define VPT_PHASE_HENYEY_GREENSTEIN 1

#define VPT_PHASE_OPAQUE 2

// Bits of `VptViewVertices::flags`; see `scene::view_flags`.
#define VPT_VIEW_CONTINUES 1

#define VPT_VIEW_VISIBLE_POINT 2

#define VPT_VIEW_LAMBERTIAN 4

#define VPT_VIEW_EMISSION 8

#define VPT_VIEW_HIT 16

#define VPT_VIEW_SCATTERED 32

#define VPT_VIEW_ABSENT 64

// Values of `VptPhotonVertices::event`; see `scene::photon_event`.
#define VPT_PHOTON_NONE 0

#define VPT_PHOTON_MEDIUM 1

#define VPT_PHOTON_SURFACE 2

// Added to an event after which the walk ended because its flux was no longer finite.
#define VPT_PHOTON_INVALID 4

// Added where the segment comes straight from a lamp that `lamp_light` finds too.
#define VPT_PHOTON_STRAIGHT 8

// No segment: the walk had ended within an earlier step of the same call.
#define VPT_PHOTON_ABSENT 16

// Values of `VptParameters::connections`.
#define VPT_CONNECTIONS_OFF 0

#define VPT_CONNECTIONS_ON 1

#define VPT_CONNECTIONS_AUTO 2

// Values of `VptShooting::mode`.
#define VPT_SHOOTING_OFF 0

#define VPT_SHOOTING_UNIFORM 1

#define VPT_SHOOTING_METROPOLIS 2

// Bits of `VptSurface::lobes`; see `scene::lobes`.
#define VPT_LOBE_SMOOTH 1

#define VPT_LOBE_DELTA_REFLECTION 2

#define VPT_LOBE_DELTA_TRANSMISSION 4

#define VPT_LOBE_NULL 8

#define VPT_LOBE_GLOSSY 16

#define VPT_LOBE_GLOSSY_TRANSMISSION 32

// Bits of `VptRules::effects`, as far as a renderer can leave out work; see `effect::Effect`.
#define VPT_EFFECT_SURFACE_GATHERING (1 << 0)

#define VPT_EFFECT_MEDIUM_SAMPLING (1 << 3)

#define VPT_EFFECT_MULTIPLE_SCATTERING (1 << 4)

#define VPT_EFFECT_COLOURED_EXTINCTION (1 << 6)

#define VPT_EFFECT_SPECULAR_CHAINS (1 << 8)

#define VPT_EFFECT_DIRECT_EMISSION (1 << 10)

#define VPT_EFFECT_ENVIRONMENT (1 << 11)

// Values per film pixel of the layers that `vpt_render` writes: red, green and blue of surfaces, media and direct emission, and
// the number of deposits per pass.
#define VPT_LAYER_CHANNELS 10

// The integrator's parameters; names and meanings are those of `method::Parameters`.
typedef struct VptParameters {
  // What is in force where nothing else is said.
  const char *preset;
  const char *method;
  const char *radius_schedule;
  // Null or empty for what the method's name says.
  const char *shooting;
  // Null or empty for the default.
  const char *photon_beams;
  // Effects that are forced on, `all` or names with commas between; null or empty for none.
  const char *effects;
  uint32_t passes;
  // 0 for automatic.
  int64_t photons;
  // 0 for automatic.
  int64_t chains;
  // 0 for automatic.
  int64_t jitter_every;
  float alpha;
  float surface_radius;
  float medium_radius;
  // -1 for no bound.
  int64_t max_depth;
  int64_t rr_depth;
  uint32_t hide_emitters;
  // One of `VPT_CONNECTIONS_*`.
  uint32_t connections;
  uint32_t emission_rays;
  uint32_t glossy_chains;
  uint32_t guided_emission;
  // 0 for automatic.
  int64_t connection_samples;
  uint32_t estimate_error;
  uint32_t layers;
  // 0 for none.
  double target_error;
  uint64_t seed;
  // Seconds; not positive for none.
  double timeout;
  // Threads of the engine; 0 for one per core.
  uint32_t threads;
} VptParameters;

// One medium of the scene.
typedef struct VptMedium {
  const char *name;
  // Nonzero where the extinction varies with position or direction.
  uint32_t varying;
  // Constant extinction per colour channel [1/length]; unused where it varies.
  float sigma_t[3];
  // Length over which a varying extinction changes; unused where it is constant.
  float feature_size;
  // Nonzero where the extinction is known to be the same in all channels, everywhere.
  uint32_t grey;
  // Nonzero where `scattering` must be asked; 0 also where nothing scatters, however the extinction varies.
  uint32_t varying_scattering;
  // Constant scattering coefficient per colour channel [1/length]; unused where it varies.
  float sigma_s[3];
  // One of `VPT_PHASE_*`.
  uint32_t phase;
  // Mean cosine of a Henyey-Greenstein phase function.
  float g;
  float bounds_min[3];
  float bounds_max[3];
} VptMedium;

// One surface of the scene.
typedef struct VptSurface {
  const char *name;
  // Bits `VPT_LOBE_*`.
  uint32_t lobes;
  // Indices of the media on its two sides, or `VPT_VACUUM`.
  uint32_t interior;
  uint32_t exterior;
} VptSurface;

// One emitter of the scene.
typedef struct VptEmitter {
  const char *name;
  // Nonzero where a ray can meet it.
  uint32_t is_visible;
  // Nonzero for a sky.
  uint32_t is_environment;
  // A ball around it; the radius is negative where it is infinitely far away.
  float centre[3];
  float radius;
} VptEmitter;

// Facts about the scene; pointers stay valid until the render ends.
typedef struct VptDescription {
  uint32_t film_size[2];
  int32_t film_offset[2];
  // 4: red, green, blue and the weight; or 5, with alpha before the weight.
  uint32_t film_channels;
  uint32_t film_pixels;
  uint32_t film_width;
  // Pixels that the film's filter reaches to either side.
  float film_filter_radius;
  // Its values for equal steps of the distance, from 0 on, and the last at the radius; at least 2.
  const float *film_filter;
  uint32_t film_filter_count;
  // Nonzero where the three channels are wavelengths, which `tune` chooses; then constants of media before it are the largest
  // of all light's.
  uint32_t spectral;
  // Where `spectral`, the red, green and blue on the film of a unit of each channel.
  float channel_colours[3][3];
  const struct VptMedium *media;
  uint32_t media_count;
  float bounds_min[3];
  float bounds_max[3];
  const struct VptSurface *surfaces;
  uint32_t surface_count;
  const struct VptEmitter *emitters;
  uint32_t emitter_count;
  const char *sensor_name;
  // Nonzero where view rays start from an aperture.
  uint32_t has_aperture;
  const char *const *warnings;
  uint32_t warning_count;
  // Lanes per batch that suit the renderer.
  uint32_t lanes;
  // Nonzero where several threads may call at the same time.
  uint32_t concurrent;
  // Vertices that a call of `photon_step` or `view_step` should yield, where few are alive by several steps; at least 1.
  uint32_t launch;
} VptDescription;

// Termination rules, and what is simulated.
typedef struct VptRules {
  uint32_t max_depth;
  uint32_t rr_depth;
  uint32_t hide_emitters;
  // Bits `VPT_EFFECT_*`; what is not set may be left out.
  uint32_t effects;
  // See `scene::PathRules`.
  uint32_t glossy_chains;
} VptRules;

// Where view rays start: `film` holds x's then y's, `numbers` aperture x, aperture y, shutter time and
// wavelength.
typedef struct VptViewRequest {
  uint32_t lanes;
  const float *film;
  const float *numbers;
  struct VptRules rules;
  // Receives the weight of each ray on the film.
  float *importance;
} VptViewRequest;

// See `scene::ViewVertices`.
typedef struct VptViewVertices {
  // Of all steps together.
  uint32_t lanes;
  uint32_t *ray;
  uint32_t *flags;
  uint32_t *medium;
  float *origin;
  float *direction;
  float *length;
  float *position;
  float *normal;
  float *geometric_normal;
  float *reflectance;
  float *emission;
  float *weight;
} VptViewVertices;

// See `scene::PhotonVertices` and, for `segment_*`, `scene::PhotonSegments`.
typedef struct VptPhotonVertices {
  // Of all steps together.
  uint32_t lanes;
  uint32_t *walk;
  uint32_t *event;
  uint32_t *medium;
  uint32_t *depth;
  float *position;
  float *direction;
  float *length;
  float *geometric_normal;
  float *flux;
  // These may be null: then they are not wanted.
  float *segment_origin;
  float *segment_flux;
  float *segment_density;
  float *segment_reach;
  float *lamp_density;
} VptPhotonVertices;

// A renderer that owns a scene. `walk` pointers are the renderer's own.
typedef struct VptHost {
  // Must be `VPT_ABI_VERSION`.
  uint32_t abi_version;
  void *context;
  int32_t (*describe)(void *context, struct VptDescription *out);
  // Where the description is `spectral`: gives the context of the same scene at the wavelengths that a number in [0,1)
  // chooses. All callbacks take it in place of their own, several such contexts side by side.
  int32_t (*tune)(void *context, float number, void **tuned);
  void (*tuned_free)(void *context, void *tuned);
  int32_t (*view_rays)(void *context,
                       const struct VptViewRequest *request,
                       void **walk,
                       uint32_t *alive);
  // As `photon_step`.
  int32_t (*view_step)(void *context,
                       void *walk,
                       uint32_t steps,
                       const float *numbers,
                       const struct VptViewVertices *out,
                       uint32_t *alive);
  void (*view_free)(void *context, void *walk);
  int32_t (*emit)(void *context,
                  uint32_t lanes,
                  const float *numbers,
                  const struct VptRules *rules,
                  void **walk,
                  uint32_t *alive);
  // Writes the indices, within the batch as it was emitted, of the walks that are alive.
  int32_t (*photon_alive)(void *context, void *walk, uint32_t *out);
  // Takes so many steps, writes for each of them one vertex per lane alive before the first, and then the number of lanes
  // alive after the last.
  int32_t (*photon_step)(void *context,
                         void *walk,
                         uint32_t steps,
                         const float *numbers,
                         const struct VptPhotonVertices *out,
                         uint32_t *alive);
  void (*photon_free)(void *context, void *walk);
  int32_t (*extinction)(void *context,
                        uint32_t count,
                        const uint32_t *medium,
                        const float *position,
                        const float *direction,
                        float *out);
  int32_t (*scattering)(void *context,
                        uint32_t count,
                        const uint32_t *medium,
                        const float *position,
                        const float *direction,
                        float *out);
  int32_t (*eval_phase)(void *context,
                        uint32_t count,
                        const uint32_t *medium,
                        const float *position,
                        const float *photon_direction,
                        const float *view_direction,
                        float *out);
  int32_t (*store_points)(void *context,
                          uint32_t count,
                          const float *origin,
                          const float *direction,
                          const uint32_t *skips_emitters,
                          uint32_t glossy_chains);
  int32_t (*eval_bsdf)(void *context,
                       uint32_t count,
                       const uint32_t *point,
                       const float *photon_direction,
                       const float *lamp_density,
                       float *out);
  // Samples a lamp for each place (`medium`, position, geometric normal or 0) and what of its light arrives there straight,
  // through null boundaries and media: the direction in which it travels, and its radiance over the density of
  // directions. `density` is as in `scene::LampLight`, or null.
  int32_t (*lamp_light)(void *context,
                        uint32_t count,
                        const uint32_t *medium,
                        const float *position,
                        const float *normal,
                        const float *numbers,
                        float *direction,
                        float *irradiance,
                        float *density);
  // Writes where on the film places on lamps would be seen if nothing were in the way: x's then y's, not a number where that is
  // not on the film or not known. `numbers` are those for the lamp, and two for the place.
  int32_t (*aim)(void *context, uint32_t count, const float *numbers, float *film);
  // Has one of the renderer's threads call `task(payload)`, once, even while another callback is under way; after a failure
  // it is not called. Like `work_until` null where the renderer lends no threads.
  int32_t (*spawn)(void *context, void (*task)(void *payload), void *payload);
  // Has the calling thread do tasks until `is_done(payload)` is nonzero.
  int32_t (*work_until)(void *context, uint32_t (*is_done)(void *payload), void *payload);
  // The sentence that belongs to the calling thread's last failed call.
  const char *(*last_error)(void *context);
} VptHost;

// How one family of photons, on surfaces or in media, is shot; see `markov::FamilyReport`.
typedef struct VptShooting {
  // One of `VPT_SHOOTING_*`.
  uint32_t mode;
  double visible_share;
  double acceptance;
  float mutation_size;
} VptShooting;

// How far the picture is off; see `film::error::ErrorEstimate`.
typedef struct VptError {
  double relative;
  double noise;
  double bias;
  double noise_decay;
  double bias_decay;
  double correlation;
  // 0 while nothing is known.
  uint32_t jitters;
} VptError;

// The state of a render between two passes.
typedef struct VptProgress {
  uint32_t passes_done;
  uint32_t passes;
  uint64_t walks;
  float surface_radius;
  float medium_radius;
  double seconds;
  struct VptShooting surface_shooting;
  struct VptShooting medium_shooting;
  struct VptError error;
  // Width and height of the film's storage, and values per pixel: red, green and blue first, the weight that divides
  // them last.
  uint32_t film_size[2];
  uint32_t film_channels;
  // The film so far, to be handed to `read_film`. Valid during the call, on its thread.
  const VptFilm *film;
  // Writes the film's weighted sums over all passes done, the present jitter's among them, to `storage` of
  // `storage_size` values (width x height x channels, row by row). It costs a splat of a jitter, so ask where the
  // picture is wanted. Returns 0, or 1 with one sentence in `error`.
  int32_t (*read_film)(const VptFilm *film,
                       double *storage,
                       size_t storage_size,
                       char *error,
                       size_t error_size);
} VptProgress;

// Watches a render.
typedef struct VptObserver {
  void *context;
  // Returns nonzero to end the render after this pass.
  int32_t (*progress)(void *context, const struct VptProgress *progress);
  // Called once at the end; the report is valid during the call.
  void (*finished)(void *context, const VptStats *stats);
  // Called for each remark that the user should read.
  void (*warn)(void *context, const char *message);
} VptObserver;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Writes the parameters of a preset, the default one where its name is null or empty; names are null. Returns 0, or 1
// with one sentence in `error`.
//
// # Safety
// `preset` must be null or null-terminated, `out` valid, and `error` hold `error_size` bytes.
int32_t vpt_default_parameters(const char *preset,
                               struct VptParameters *out,
                               char *error,
                               size_t error_size);

// Checks parameters before any rendering. Returns 0, or 1 with one sentence in `error`.
//
// # Safety
// `parameters` must be valid, with null-terminated strings, and `error` must hold `error_size` bytes.
int32_t vpt_check_parameters(const struct VptParameters *parameters,
                             char *error,
                             size_t error_size);

// Renders the scene behind `host` and adds the film's weighted sums to `storage`. Writes the estimated
// standard error of red, green and blue of every film pixel to `error_image`, unless that is null; zeros
// where nothing is known. Writes the layers' sums, to be divided by the film's weights, to `layers`, unless that is null; zeros
// where the parameters do not ask for them. Returns 0, or 1 with one sentence in `error`.
//
// # Safety
// All pointers must be valid for the call; `storage` must hold `storage_size` values and `error_image`
// three and `layers` `VPT_LAYER_CHANNELS` per film pixel; the callbacks of `host` and `observer` must keep the promises of this page.
int32_t vpt_render(const struct VptHost *host,
                   const struct VptParameters *parameters,
                   const struct VptObserver *observer,
                   double *storage,
                   size_t storage_size,
                   float *error_image,
                   double *layers,
                   char *error,
                   size_t error_size);

// `VPT_ABI_VERSION`, for programs that were not compiled with `vpt.h`.
uint32_t vpt_abi_version(void);

// Makes the Mitsuba of this process know the integrator in every variant, wherever it looks for plugins. Returns 0, or 1
// with one sentence in `error`.
//
// # Safety
// `error` must hold `error_size` bytes.
int32_t vpt_install(char *error,
                    size_t error_size);

// Lets `observer` watch all renders that Mitsuba starts on the calling thread from now on, in place of Mitsuba's log; null
// for the log. Returns the one that watched before. `progress` may be called on another thread, while the calling one waits.
//
// # Safety
// The observer must be valid until another one takes its place.
const struct VptObserver *vpt_watch(const struct VptObserver *observer);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus
