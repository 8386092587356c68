"""Advice of warnings, applied as it stands: the case stays accepted, and the warning is gone."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import BEAM, GOOD
from tests.unit.test_advice import CHOICES, PART, VALUE

PLACE = re.compile(rf'(?:\[\[(\w+)\]\] number (\d+) \(name "[^"]*"\)|\[([\w.]+)\]) ?(?:(\w+)(?: = {VALUE}|:))?')
TOGETHER = re.compile(rf"(?<![\w.]){PART}(?: with {PART})*")
UNIT = re.compile(r"is it in [^\s,]+, (\S+?)(?: [^\s?]+)?\?")
OR_MORE = re.compile(r"(\w+) = \S+ is low: (\d+) or more")
PLANE = '[[support]]\nname = "a"\nfrom = 0.0\nto = 0.1\nclearance = 1e-4\n'
SWEEP = (
    '[[load]]\ntype = "swept-sine"\nname = "sweep"\npoint = 0.3\namplitude = 1.0\n'
    "start_frequency = 100.0\nend_frequency = 200.0\nduration = 3.0\n"
)
SHAKEN = '[[load]]\ntype = "support_motion"\nname = "wall"\nsupport = "a"\namplitude = 1e-5\nfrequency = 30.0\n'
WARNED = {
    "beam length in mm": BEAM.replace("length = 0.6", "length = 600.0") + PLANE,
    "thickness in mm": BEAM.replace("thickness = 0.012", "thickness = 1.2") + PLANE,
    "clearance in mm": BEAM + PLANE.replace("1e-4", "0.1"),
    "modulus in GPa": BEAM.replace("young_modulus = 2.1e11", "young_modulus = 210.0") + PLANE,
    "modulus in MPa": BEAM.replace("young_modulus = 2.1e11", "young_modulus = 2.1e5") + PLANE,
    "density in g/cm^3": BEAM.replace("density = 7919.0", "density = 7.919") + PLANE,
    "damping in %": BEAM + PLANE + '[damping]\nratio = 0.9\n[model]\ntype = "reduced"\n',
    "few elements": BEAM + PLANE.replace("to = 0.1", "to = 0.02") + '[model]\ntype = "beam"\nelements = 10\n',
    "few graded elements": BEAM + PLANE + '[model]\ntype = "beam"\nelements = 6\nspacing = "graded"\n',
    "low quadrature degree": BEAM + PLANE + "[contact]\nquadrature_degree = 1\n",
    "small patches": BEAM
    + "[support]\nlength = 0.1\nclearance = 1e-4\n[contact]\npoints = [0.0, 0.1]\npatch = 1e-4\nstiffness = 1e8\n",
    "a sweep longer than the run": BEAM + PLANE + SWEEP,
    "a wall that jumps": BEAM + PLANE + SHAKEN,
}


def said(text: str, overrides: Sequence[str] = ()) -> list[str]:
    """Return the warnings of a case; none where it is refused."""
    try:
        return warnings(read_case_text(text, list(overrides)))
    except CaseError:
        return []


def advice_of(line: str) -> Iterator[list[str]]:
    """Yield the pieces of advice of a warning, each as overrides that belong together."""
    place = PLACE.match(line)
    if place is None:
        return
    array, number, table, key = place.groups()
    path = f"{array}.{int(number) - 1}" if array else table
    rest = line[place.end() :]
    for found in TOGETHER.finditer(rest.replace("at t = 0", "")):
        parts = re.findall(PART, found[0])
        yield [part if "." in part.split(" = ")[0] else f"{path}.{part}" for part in parts]
    if (unit := UNIT.search(rest)) and key:
        yield [f"{path}.{key} = {unit[1]}"]
    if more := OR_MORE.search(line):
        yield [f"{path}.{more[1]} = {more[2]}"]


def kind(line: str) -> str:
    """Return a warning without its figures."""
    return re.sub(VALUE, "#", line)


def check_warnings(text: str, given_: Sequence[str] = ()) -> int:
    """Check all advice in the warnings of a case; return how many pieces there were."""
    count = 0
    for line in said(text, given_):
        for overrides in advice_of(line):
            keys = {one.split(" = ")[0] for one in overrides}
            kept = [one for one in given_ if one.split(" = ")[0] not in keys]
            after = warnings(read_case_text(text, [*kept, *overrides]))
            assert kind(line) not in map(kind, after), f"{given_}: {overrides} does not help:\n{line}\n{after}"
            count += 1
    return count


@pytest.mark.parametrize("name", WARNED)
def test_advice_of_a_warning_helps(name: str) -> None:
    """One warning of each kind that names a value."""
    assert check_warnings(WARNED[name]) > 0


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.lists(st.sampled_from(CHOICES), min_size=1, max_size=4, unique_by=lambda one: one.split(" = ")[0]))
def test_advice_of_warnings_of_drawn_cases_helps(choices: list[str]) -> None:
    """Whatever choices stand side by side."""
    check_warnings(GOOD, choices)
