"""A small case without faults, and how tests spoil it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.messages.errors import CaseError, Fault

BEAM = """
[beam]
length = 0.6
thickness = 0.012
width = 0.02
[material]
young_modulus = 2.1e11
poisson_ratio = 0.3
density = 7919.0
[time]
end = 0.1
step = 1e-4
[[load]]
type = "gravity"
[[probe]]
name = "tip"
point = 0.6
"""
"""A beam of 0.6 m under its weight, without supports."""

GOOD = """\
title = "good"

[beam]
length = 0.510
thickness = 0.012
width = 0.020

[material]
young_modulus = 2.1e11
poisson_ratio = 0.3
density = 7919.0

[damping]
frequencies = [40.0, 300.0]
ratios = [0.01, 0.01]

[support]
length = 0.050
clearance = 0.107e-3

[mesh]
dimension = 2
degree = 2

[contact]
stiffness = "auto"

[[load]]
type = "gravity"

[[load]]
type = "harmonic_force"
name = "shaker"
point = 0.15
amplitude = 20.0
frequency = 20.0

[[probe]]
name = "tip"
point = 0.510

[time]
end = 0.6
step = 1.0e-4
scheme = "discrete-gradient"

[output]
"""


def written(folder: Path, text: str = GOOD) -> Path:
    """Return the path of a case file with this text."""
    path = folder / "case.toml"
    path.write_bytes(text.encode())
    return path


def spoiled(old: str, new: str) -> str:
    """Return the good case with one passage replaced."""
    assert GOOD.count(old) == 1, f"{GOOD.count(old)} times in the good case: {old}"
    return GOOD.replace(old, new)


def faults_of(path: Path, overrides: Overrides = ()) -> tuple[Fault, ...]:
    """Return the faults of a bad case."""
    with pytest.raises(CaseError) as caught:
        read_case(path, overrides)
    return caught.value.faults


def assert_says(fault: object, words: Iterable[str]) -> None:
    """Every one of these words stands in the message of a fault."""
    message = str(fault)
    for word in words:
        assert word in message, f"{word!r} is not in:\n{message}"


def assert_refused(read: Callable[[Path], object], file: Path, text: str, says: str) -> None:
    """A file of a study with this text is refused: its fault says what was found, and what was expected."""
    file.write_text(text)
    with pytest.raises(CaseError) as fault:
        read(file)
    assert says in str(fault.value)
    assert "expected" in str(fault.value)
