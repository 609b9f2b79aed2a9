#include "observer.h"

#include "mitsuba.h"

#include <mitsuba/core/progress.h>

#include <utility>

namespace vpt {

using namespace mitsuba;

const VptObserver *&embedding_observer() {
    thread_local const VptObserver *observer = nullptr;
    return observer;
}

struct RenderWatch::Bar {
    ref<ProgressReporter> reporter;
};

RenderWatch::RenderWatch(std::function<bool()> should_stop)
    : m_should_stop(std::move(should_stop)), m_embedding(embedding_observer()), m_bar(new Bar) {}

RenderWatch::~RenderWatch() = default;

VptObserver RenderWatch::table() { return { this, &progress, &finished, &warn }; }

int32_t RenderWatch::progress(void *self_, const VptProgress *progress) {
    auto *self = static_cast<RenderWatch *>(self_);
    if (self->m_embedding) {
        if (self->m_embedding->progress(self->m_embedding->context, progress) != 0)
            return 1;
    } else {
        self->log_progress(*progress);
    }
    return self->m_should_stop() ? 1 : 0;
}

void RenderWatch::log_progress(const VptProgress &progress) {
    Logger *log = logger();
    if (!log || Info < log->log_level())
        return;
    if (progress.passes_done == 0) {
        Log(Info, "vpt: %i passes, radii of the first: %g on surfaces, %g in media", progress.passes,
            progress.surface_radius, progress.medium_radius);
        m_bar->reporter = new ProgressReporter("Photon passes");
    } else if (m_bar->reporter) {
        m_bar->reporter->update(progress.passes_done / (float) progress.passes);
    }
}

void RenderWatch::finished(void *self_, const VptStats *stats) {
    auto *self = static_cast<RenderWatch *>(self_);
    if (self->m_embedding)
        self->m_embedding->finished(self->m_embedding->context, stats);
}

void RenderWatch::warn(void *self_, const char *message) {
    auto *self = static_cast<RenderWatch *>(self_);
    if (self->m_embedding)
        self->m_embedding->warn(self->m_embedding->context, message);
    else
        Log(Warn, "vpt: %s", message);
}

}

extern "C" const VptObserver *vpt_shim_watch(const VptObserver *observer) noexcept {
    return std::exchange(vpt::embedding_observer(), observer);
}
