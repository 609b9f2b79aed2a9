/* Compiled as C11 and as C++17: the header stands alone and may be included twice. */
#include "vpt.h"
#include "vpt.h"

int (*const vpt_render_is_declared)(const struct VptHost *, const struct VptParameters *,
                                    const struct VptObserver *, double *, size_t, float *, double *,
                                    char *, size_t) = vpt_render;
