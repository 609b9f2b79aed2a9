"""Progressive volume photon tracing for Mitsuba 3.

Importing this package makes ``{"type": "vpt"}`` known to Mitsuba, in Python and XML, in every variant that the plugin
supports, before or after ``mi.set_variant``::

    import mitsuba as mi
    import mitsuba_vpt

    mi.set_variant("llvm_ad_rgb")
    scene = mi.load_file("scene.xml")
    image = mitsuba_vpt.render(scene, spp=64, progress=True)
"""

from ._mitsuba import REQUIRED as MITSUBA_VERSION
from ._mitsuba import require_mitsuba

require_mitsuba()

from ._compare import Comparison, compare  # noqa: E402 - nothing else may import another Mitsuba
from ._denoise import Denoised, denoise  # noqa: E402
from ._display import Monitor  # noqa: E402
from ._plugin import install, plugin_dir  # noqa: E402
from ._program import ProgramError, run  # noqa: E402
from ._progress import observe, render  # noqa: E402
from ._state import Progress  # noqa: E402

install()

__all__ = [
    "MITSUBA_VERSION",
    "Comparison",
    "Denoised",
    "Monitor",
    "ProgramError",
    "Progress",
    "compare",
    "denoise",
    "observe",
    "plugin_dir",
    "render",
    "run",
]
