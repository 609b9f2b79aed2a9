"""Programs of Dr.Jit that are recorded once and replayed."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from conftest import LLVM, array, load


@pytest.mark.skipif(not LLVM, reason="there is no libLLVM")
@pytest.mark.parametrize("name", ["llvm_ad_rgb", "llvm_ad_spectral"])
def test_replayed_programs_give_the_same_picture(name):
    """View rays, photons and connections take the same ways as in programs written anew for each call."""
    mi.set_variant(name)
    scene = load(spp="6")
    replayed = array(mi.render(scene))
    with dr.scoped_set_flag(dr.JitFlag.KernelFreezing, False):
        written = array(mi.render(scene))
    assert np.isfinite(written).all() and written.max() > 0
    # Mitsuba's film adds up in whatever order its threads come.
    np.testing.assert_allclose(replayed, written, rtol=1e-5)
