"""Results folders with a file that is cut, missing or another one: readers name the file, and never end in a trace."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as some

import gapbeam
from gapbeam.solver.schema.record_table import CASE_FILE, HISTORY_FILE, SUMMARY_FILE
from tests.shared.command import called

READ = (HISTORY_FILE, SUMMARY_FILE, CASE_FILE)
"""Files that records, reports and comparisons are made of."""
WAYS = ("cut", "missing", "empty", "another file", "a folder")
NO_ADVICE = "contents that do not go together"
"""Words of an error that nothing foresaw."""

SHAKEN: dict[str, Any] = {
    "beam": {"length": 0.5, "thickness": 0.02, "width": 0.02},
    "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
    "damping": {"mass": 0.0, "stiffness": 0.0},
    "support": [{"name": "s", "from": 0.1, "to": 0.4, "clearance": 1e-4}],
    "model": {"type": "rigid"},
    "contact": {"stiffness": 1e12},
    "load": [{"type": "gravity"}, {"type": "base_motion", "name": "shaker", "amplitude": 30.0, "frequency": 500.0}],
    "probe": [{"name": "tip", "point": 0.5}],
    "analysis": {"type": "transient", "start": "undeformed"},
    "time": {"end": 0.024, "step": 2e-5},
    "output": {"errors": "none"},
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the results of a case and of a scene, `case` and `scene`."""
    place = tmp_path_factory.mktemp("whole")
    assert gapbeam.run(SHAKEN, output=place / "case").exit_status == 0
    one = gapbeam.mass(1.0)
    wall = gapbeam.Contact(one["at"], gapbeam.HalfPlane(0.0), gapbeam.KelvinVoigt(stiffness=1e6), name="wall")
    scene = gapbeam.Scene(one, contacts=[wall], loads=[gapbeam.Force(one["at"], 9.81, name="weight")])
    assert gapbeam.run(scene, step=1e-5, end=0.01, output=place / "scene").exit_status == 0
    return place


@some.composite
def damages(draw: some.DrawFn) -> tuple[str, str, str, float]:
    """Draw whose results are damaged, which file, how, and where it is cut, as a share of its length."""
    file = draw(some.sampled_from(READ))
    kind = "case" if file == CASE_FILE else draw(some.sampled_from(("case", "scene")))
    return kind, file, draw(some.sampled_from(WAYS)), draw(some.floats(0.0, 0.999))


def damaged(whole: Path, file: str, way: str, share: float) -> Path:
    """Return a copy of a results folder with one file damaged."""
    folder = whole.parent / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(whole, folder)
    path = folder / file
    content = path.read_bytes()
    path.unlink()
    match way:
        case "cut":
            path.write_bytes(content[: int(share * len(content))])
        case "empty":
            path.touch()
        case "a folder":
            path.mkdir()
        case "another file":
            others = sorted(one for one in whole.iterdir() if one.is_file() and one.name != file)
            path.write_bytes(others[int(share * len(others))].read_bytes())
    return folder


def read(folder: Path) -> None:
    """Read what the folder has of records, summary and case."""
    found = gapbeam.open_results(folder)
    assert np.all(np.diff(found.history["time"]) > 0.0)
    assert isinstance(found.summary, dict)
    assert isinstance(found.case, dict)
    assert found.title


def complaint(work: Callable[[], object]) -> str:
    """Return what a reader says of damaged results, one error of status 2; empty where it does without the file."""
    try:
        work()
    except Exception as fault:
        if getattr(fault, "exit_status", None) != 2:
            raise
        return str(fault)
    return ""


@pytest.mark.slow(minutes=0.1)
@settings(max_examples=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(damages())
def test_readers_name_the_damaged_file(folders: Path, damage: tuple[str, str, str, float]) -> None:
    """Records are needed, and a summary that is there has to be one; a run that was killed has none."""
    kind, file, way, share = damage
    said = complaint(lambda: read(damaged(folders / kind, file, way, share)))
    assert NO_ADVICE not in said
    if said:
        assert file in said
        assert "expected" in said
        assert "To try" in said
    else:
        assert file != HISTORY_FILE or way == "cut"


READERS: dict[str, Callable[[Path, Path], object]] = {
    "plot": lambda folder, _: gapbeam.plot(folder, folder.parent / "figures"),
    "report": lambda folder, _: gapbeam.report(folder, folder.parent / "page.html", pdf=False, overwrite=True),
    "compare": lambda folder, whole: gapbeam.compare(whole, folder, output=folder.parent / "compared"),
    "export": lambda folder, _: gapbeam.export(folder, folder.parent / "columns.csv"),
}


@pytest.mark.slow(minutes=0.4)
@settings(max_examples=16, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(damages(), some.sampled_from(tuple(READERS)))
def test_commands_name_the_damaged_file(folders: Path, damage: tuple[str, str, str, float], reader: str) -> None:
    """Of figures, pages, comparisons and tables: each is made without the file, or refused with its name."""
    kind, file, way, share = damage
    assume(reader != "compare" or kind == "case")  # no forcing of a scene has a known period
    whole = folders / kind
    said = complaint(lambda: READERS[reader](damaged(whole, file, way, share), whole))
    assert NO_ADVICE not in said
    assert not said or file in said


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize("command", ["plot", "report", "compare"])
def test_commands_end_with_status_2(folders: Path, command: str) -> None:
    """As users call them, with records that are cut in the middle."""
    folder = damaged(folders / "case", HISTORY_FILE, "cut", 0.5)
    ended = called(command, folder, *([folders / "case"] if command == "compare" else []))
    assert ended.returncode == 2
    assert HISTORY_FILE in ended.stderr
    assert "Traceback" not in ended.stderr
