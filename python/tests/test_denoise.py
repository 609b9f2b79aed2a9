"""Denoising takes noise away, and marks where it takes more."""

import mitsuba as mi
import numpy as np
import pytest
from conftest import array, load, python

import mitsuba_vpt

SIGMA = 0.05


@pytest.fixture(scope="module")
def ramp():
    """A ramp of light, and the same with normal noise and one bright pixel, which is there."""
    truth = (np.linspace(0.2, 1, 64)[None, :, None] * np.ones((64, 64, 3))).astype(np.float32)
    truth[32, 40] = 3
    noise = np.random.default_rng(1).normal(0, SIGMA, truth.shape)
    return truth, (truth + noise).astype(np.float32)


def test_noise_goes_and_lost_detail_is_marked(ramp):
    truth, noisy = ramp
    done = mitsuba_vpt.denoise(noisy, np.full_like(noisy, SIGMA))
    flat = np.ones(truth.shape[:2], bool)
    flat[30:35, 38:43] = False
    rmse = [np.sqrt(np.mean((picture - truth)[flat] ** 2)) for picture in (noisy, done.image)]
    assert rmse[1] < 0.3 * rmse[0]
    assert done.biased[32, 40]
    # Beside it next to nothing: 64 * 64 * 3 normal values, each beyond 4 deviations once in 16,000 (0.8 expected), and
    # what the ramp is moved by.
    assert np.count_nonzero(done.biased[flat]) <= 8
    assert done.biased_share == np.mean(done.biased)


def test_errors_of_a_render_are_taken(scalar):
    scene = load(spp="8")
    image = array(mi.render(scene, integrator=mi.load_dict({"type": "vpt", "error_image": True})))
    done = mitsuba_vpt.denoise(image[..., :3], image[..., 3:6])
    assert done.image.shape == (24, 24, 3)
    assert done.biased_share < 1


def test_what_does_not_fit_is_refused(ramp):
    _, noisy = ramp
    with pytest.raises(ValueError, match=r"\(64, 64, 3\) and \(64, 64\)"):
        mitsuba_vpt.denoise(noisy, noisy[..., 0])
    with pytest.raises(ValueError, match="at least two jitters"):
        mitsuba_vpt.denoise(noisy, np.zeros_like(noisy))


def test_absent_package_is_named():
    done = python("import sys; sys.modules['mitsuba_oidn'] = None; import mitsuba_vpt; mitsuba_vpt.denoise(0, 0)")
    assert "pip install mitsuba-vpt[denoise]" in done.stderr.splitlines()[-1]
