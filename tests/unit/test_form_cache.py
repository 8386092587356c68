"""Compiled forms: a compilation that was cut off is done again, not waited for."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import cffi
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

import gapbeam.solver.assembly.form_cache
from gapbeam.meshes.versions.form_compiler import half_made
from gapbeam.solver.assembly.form_cache import compiled_form
from tests.shared.command import alone
from tests.shared.processes import appears, beside, ended

pytestmark = [alone, pytest.mark.versions]


def length(factor: float) -> Any:
    """Return a form that no other test has: a factor times the length of an interval."""
    interval = mesh.create_unit_interval(MPI.COMM_SELF, 3)
    return factor * ufl.dx(domain=interval)


def value(form: fem.Form) -> float:
    return float(fem.assemble_scalar(form).real)


@pytest.mark.parametrize("left", ["the source", "no library"])
def test_compilation_that_was_killed_is_done_again(left: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kill -9 of the process that compiles, or a library that is gone: the next one compiles, and soon."""
    cache, compiles = tmp_path / "cache", tmp_path / "compiles"
    monkeypatch.setattr(gapbeam.solver.assembly.form_cache, "cache_folder", lambda: cache)
    form = length(1.25)

    def work() -> int:
        if left == "the source":
            cffi.FFI.compile = lambda *_, **__: (compiles.touch(), signal.pause())
        compiled_form(form)
        (cache / next(cache.glob("*.so"))).unlink()
        compiles.touch()
        signal.pause()
        return 0

    process = beside(work, tmp_path / "messages")
    appears(compiles)
    os.kill(process, signal.SIGKILL)
    assert ended(process) == -signal.SIGKILL
    assert len(list(cache.glob("*.c"))) == 1
    assert not list(cache.glob("*.so"))
    assert value(compiled_form(form)) == pytest.approx(1.25)
    assert len(list(cache.glob("*.c.cached"))) == len(list(cache.glob("*.so"))) == 1


def test_forms_are_compiled_without_a_folder_for_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No lock can be had: DOLFINx tries, and reports what it misses."""
    (tmp_path / "file").touch()
    monkeypatch.setattr(gapbeam.solver.assembly.form_cache, "cache_folder", lambda: tmp_path / "file")
    with pytest.raises(OSError, match="file"):
        compiled_form(length(1.5))


def test_a_large_cache_is_listed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With thousands of forms, a search for the parts of each would take seconds whenever a model is set up."""
    parts = ("c", "c.cached", "o", "cpython-313-x86_64-linux-gnu.so")
    for number in range(300):
        for part in parts:
            (tmp_path / f"libffcx_forms_{number}.{part}").touch()
    (tmp_path / "libffcx_forms_7.c.cached").unlink()
    (tmp_path / "libffcx_forms_8.cpython-313-x86_64-linux-gnu.so").unlink()
    looks = []
    whole = os.scandir
    monkeypatch.setattr(os, "scandir", lambda *given: looks.append(given) or whole(*given))
    listed = os.listdir
    monkeypatch.setattr(os, "listdir", lambda *given: looks.append(given) or listed(*given))
    found = {paths[0].name.partition(".")[0]: len(paths) for paths in half_made(tmp_path)}
    assert found == {"libffcx_forms_7": 3, "libffcx_forms_8": 3}
    assert len(looks) <= 1
