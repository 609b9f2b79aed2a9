"""The structures of ctypes are those of the C header."""

import ctypes
import re

import pytest
from conftest import ROOT

from mitsuba_vpt import _abi

HEADER = (ROOT / "include" / "vpt.h").read_text()

C_TYPES = {
    ctypes.c_uint32: "uint32_t",
    ctypes.c_uint64: "uint64_t",
    ctypes.c_float: "float",
    ctypes.c_double: "double",
    ctypes.c_void_p: "void *",
}


def members(struct: str) -> list[tuple[str, str]]:
    """Names and types of a structure's members, as the header has them; those of functions are their names alone."""
    body = re.search(rf"typedef struct {struct} \{{(.*?)\n\}} {struct};", HEADER, re.DOTALL)[1]
    body = re.sub(r"//.*", "", body)
    found = []
    for declaration in filter(None, (" ".join(part.split()) for part in body.split(";"))):
        function = re.match(r".*?\(\*(\w+)\)\(", declaration)
        name, length = (function[1], "") if function else re.search(r"(\w+)(\[\d+\])?$", declaration).groups()
        kind = declaration.removesuffix(length or "").removesuffix(name).strip().removeprefix("struct ")
        # To Python a pointer is a pointer.
        kind = "function" if function else "void *" if kind.endswith("*") else kind + (length or "")
        found.append((name, kind))
    return found


def c_type(python_type) -> str:
    """How C names a type of ctypes."""
    if issubclass(python_type, ctypes.Array):
        return f"{c_type(python_type._type_)}[{python_type._length_}]"
    if issubclass(python_type, ctypes._CFuncPtr):
        return "function"
    if issubclass(python_type, ctypes.Structure):
        return f"Vpt{python_type.__name__}"
    return C_TYPES[python_type]


@pytest.mark.parametrize("struct", [_abi.Shooting, _abi.Error, _abi.Progress, _abi.Observer])
def test_members_are_those_of_the_header(struct):
    assert [(name, c_type(kind)) for name, kind in struct._fields_] == members(f"Vpt{struct.__name__}")


def test_version_is_that_of_the_header():
    assert int(re.search(r"#define VPT_ABI_VERSION (\d+)", HEADER)[1]) == _abi.VERSION
