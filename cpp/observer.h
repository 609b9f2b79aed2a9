// Watching a render from Mitsuba's side: its log and progress bar, its `cancel()`, and whoever the
// embedding program has put in their place.
#pragma once

#include "vpt.h"

#include <functional>
#include <memory>

namespace vpt {

// The embedding program's observer for renders on this thread; null for Mitsuba's own log.
const VptObserver *&embedding_observer();

class RenderWatch {
public:
    explicit RenderWatch(std::function<bool()> should_stop);
    ~RenderWatch();
    VptObserver table();

private:
    static int32_t progress(void *self, const VptProgress *progress);
    static void finished(void *self, const VptStats *stats);
    static void warn(void *self, const char *message);
    void log_progress(const VptProgress &progress);

    struct Bar;
    std::function<bool()> m_should_stop;
    const VptObserver *m_embedding;
    std::unique_ptr<Bar> m_bar;
};

}
