"""Callbacks: called after each pass, able to end a render, unable to break it."""

import signal
import subprocess
import sys
import threading
import time

import mitsuba as mi
import numpy as np
import pytest
from conftest import PASSES, SCENE, array, load

import mitsuba_vpt


def test_is_told_of_each_pass(variant):
    seen = []
    start = time.perf_counter()
    mitsuba_vpt.render(load(), spp=5, progress=seen.append)
    took = time.perf_counter() - start
    assert [p.passes_done for p in seen] == [1, 2, 3, 4, 5]
    assert all(p.passes == 5 for p in seen)
    seconds = [p.seconds for p in seen]
    assert 0 < seconds[0] < seconds[-1] <= took
    assert seconds == sorted(seconds)
    assert seen[-1].walks > seen[0].walks > 0
    assert seen[0].medium_radius > seen[-1].medium_radius > 0
    # One jitter tells nothing of the spread of jitters, several do.
    assert seen[0].error is None
    assert 0 < seen[-1].error < 1


def test_watching_changes_no_bit(scalar):
    assert np.array_equal(
        array(mitsuba_vpt.render(load(), seed=3, progress=lambda progress: None)), array(mi.render(load(), seed=3))
    )


def test_false_ends_the_render_with_the_picture_of_the_passes_done(scalar):
    stopped = mitsuba_vpt.render(load(), spp=1000, progress=lambda progress: progress.passes_done < 2)
    assert np.array_equal(array(stopped), array(mi.render(load(), spp=2)))


def test_only_false_ends_the_render(scalar):
    passes = []
    mitsuba_vpt.render(load(), progress=lambda progress: passes.append(progress.passes_done) or 0)
    assert passes == [1, 2, 3]


def test_what_a_callback_raises_reaches_the_caller(variant):
    calls = []

    def fail(progress):
        calls.append(progress.passes_done)
        raise LookupError("on purpose")

    with pytest.raises(LookupError, match="on purpose") as caught:
        mitsuba_vpt.render(load(), spp=1000, progress=fail)
    assert calls == [1]
    assert "fail" in [entry.name for entry in caught.traceback]
    # Nothing watches afterwards.
    mi.render(load())
    assert calls == [1]


def test_plain_renders_are_observed(variant):
    passes = []
    with mitsuba_vpt.observe(lambda progress: passes.append(progress.passes_done)):
        mi.render(load())
        mi.render(load(), spp=1)
    mi.render(load())
    assert passes == [1, 2, 3, 1]


def test_picture_so_far_is_that_of_fewer_passes(variant):
    pictures = []
    final = array(mitsuba_vpt.render(load(), progress=lambda progress: pictures.append(progress.image())))
    assert len(pictures) == PASSES
    assert all(picture.dtype == np.float32 for picture in pictures)
    # The same sums: scalar variants multiply by the weight's reciprocal (two roundings of 2^-24), others divide.
    np.testing.assert_allclose(pictures[-1], final, rtol=2**-23 if variant == "scalar_rgb" else 0)
    if variant == "scalar_rgb":
        np.testing.assert_allclose(pictures[0], array(mi.render(load(), spp=1)), rtol=2**-23)


def test_picture_so_far_of_a_spectral_variant_is_one_of_colours():
    mi.set_variant("scalar_spectral")
    pictures = []
    final = array(mitsuba_vpt.render(load(), progress=lambda progress: pictures.append(progress.image())))
    np.testing.assert_allclose(pictures[-1], final, rtol=2**-23)


def test_picture_is_there_during_the_callback_alone(scalar):
    seen = []
    mitsuba_vpt.render(load(), progress=seen.append)
    with pytest.raises(RuntimeError, match="during the callback"):
        seen[0].image()


def test_inner_observers_take_over(scalar):
    outer, inner = [], []
    with mitsuba_vpt.observe(outer.append):
        with mitsuba_vpt.observe(inner.append):
            mi.render(load())
        mi.render(load(), spp=1)
    assert (len(inner), len(outer)) == (PASSES, 1)


def test_threads_have_observers_of_their_own(scalar):
    scenes, seen = {passes: load(spp=str(passes)) for passes in (2, 4)}, {2: [], 4: []}

    def work(passes):
        mitsuba_vpt.render(scenes[passes], progress=lambda progress: seen[passes].append(progress.passes))

    threads = [threading.Thread(target=work, args=(passes,)) for passes in scenes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen == {2: [2] * 2, 4: [4] * 4}


def test_callbacks_do_not_hold_other_threads_up(scalar):
    ticks = []
    done = threading.Event()

    def tick():
        while not done.wait(0.001):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    mitsuba_vpt.render(load(), spp=20, progress=lambda progress: None)
    done.set()
    thread.join()
    assert len(ticks) > 5


INTERRUPTED = """
import faulthandler, signal, sys, mitsuba as mi, mitsuba_vpt
faulthandler.dump_traceback_later(60, exit=True)  # should it not be heard
signal.signal(signal.SIGINT, signal.default_int_handler)
mi.set_variant(sys.argv[1])
scene = mi.load_file(sys.argv[2], resx="24", resy="24")
try:
    mitsuba_vpt.render(scene, spp=1_000_000, progress=lambda progress: print(progress.passes_done, flush=True))
except KeyboardInterrupt:
    pass
try:
    print("interrupted", flush=True)
    while True:
        pass
except KeyboardInterrupt:
    print("interrupted again")
"""


def test_ctrl_c_ends_the_render_and_reaches_the_caller(variant):
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, variant, str(SCENE)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while process.stdout.readline().strip() != "4":
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    lines = iter(process.stdout.readline, "")
    # Mitsuba resets colours at the start of the next line.
    assert any(line.strip().endswith("interrupted") for line in lines)
    # The loop of plain Python that follows is interrupted as ever.
    process.send_signal(signal.SIGINT)
    said, error = process.communicate(timeout=60)
    assert said.removesuffix("\x1b[0m").strip() == "interrupted again"
    assert (process.returncode, error) == (0, "")


def test_ctrl_c_within_a_callback_reaches_the_caller(variant):
    # Shells start background jobs without a handler, and Mitsuba's stays behind where renders overlapped.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    passes = []

    def interrupt(progress):
        passes.append(progress.passes_done)
        if progress.passes_done == 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        mitsuba_vpt.render(load(), spp=100_000, progress=interrupt)
    assert passes == [1, 2]


def test_true_shows_a_line(scalar, capsys):
    mitsuba_vpt.render(load(), progress=True)
    said = capsys.readouterr().err
    assert f"pass {PASSES} of {PASSES}" in said
    assert "% off" in said


def test_integrators_that_tell_nothing_are_refused(scalar):
    with pytest.raises(TypeError, match=r"the scene's integrator is PathIntegrator; give integrator="):
        mitsuba_vpt.render(load(integrator="path"), progress=True)
    seen = []
    mitsuba_vpt.render(load(integrator="path"), integrator=mi.load_dict({"type": "vpt"}), progress=seen.append)
    assert len(seen) == PASSES


class Impatient(mitsuba_vpt.Monitor):
    def __call__(self, progress):
        super().__call__(progress)
        return progress.passes_done < 7


def test_the_last_pass_is_shown_where_a_render_ended_early(scalar, capsys):
    mitsuba_vpt.render(load(), spp=1000, progress=Impatient(every=1e9))
    said = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in said] == ["vpt: pass 1 of 1000", "vpt: pass 7 of 1000"]


def test_progress_bar_of_a_notebook():
    monitor = mitsuba_vpt.Monitor()
    assert '<progress max="1" value="0.0000">' in monitor._repr_html_()
