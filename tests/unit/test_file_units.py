"""Faults of a file that names its units: numbers as the file has them, and advice that can be typed there."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.messages.errors import CaseError, Fault

CASE = """units = "UNITS"
[beam]
length = 510
thickness = 12
width = 12
section = { type = "tube", wall = 2 }
[material]
young_modulus = 2.1e5
poisson_ratio = 0.3
density = 7.85e-9
[mesh]
dimension = 3
size = 12
[[support]]
name = "a"
from = 100
to = 120
clearance = 0.2
[[joint]]
name = "j"
type = "clamped"
point = 0
[[mass]]
name = "head"
point = 500
mass = 1e-4
[[fluid]]
name = "water"
from = 200
to = 400
added_mass = 1e-7
[[load]]
type = "clearance_change"
support = "a"
times = [0, 0.05]
changes = [0, -0.1]
[time]
end = 0.05
"""
PLAIN = """units = "UNITS"
beam = { length = 500, thickness = 10, width = 20 }
material = { young_modulus = 2.1e5, poisson_ratio = 0.3, density = 7.85e-9 }
support = { length = 50, clearance = 0.2 }
load = [{ type = "harmonic_force", point = 150, amplitude = 20, frequency = 20 }]
time = { end = 0.05 }
"""
LENGTHS = {"length", "thickness", "width", "size", "from", "to", "clearance", "point", "changes"}
SPOILED = {
    "joint beyond the end": ("point = 0\n", "point = {}\n", (600, 9e4)),
    "mass beyond the end": ("point = 500", "point = {}", (600, 9e4)),
    "support beyond the end": ("to = 120", "to = {}", (600, 9e4)),
    "support that ends before": ("from = 100", "from = {}", (121, 400)),
    "fluid beyond the end": ("to = 400", "to = {}", (600, 9e4)),
    "wall": ("wall = 2", "wall = {}", (6.5, 500)),
    "cell": ("size = 12", "size = {}", (600, 9e4)),
    "interference": ("clearance = 0.2", "clearance = -{}", (7, 300)),
    "closure": ("[0, -0.1]", "[0, -{}]", (7, 300)),
    "minus": ("thickness = 12", "thickness = -{}", (1, 30)),
    "in brackets": ("length = 510", "length = [{}]", (500, 900)),
    "unit in quotes": ("length = 510", 'length = "{} mm"', (500, 900)),
    "quotes": ("length = 510", 'length = "{}"', (500, 900)),
}


def in_units(units: str, text: str = CASE) -> str:
    """Return a case in a system of units: lengths stay in mm, or are in m; the material as it should be there."""
    text = text.replace("UNITS", units)
    return text if units == "mm-t-s" else text.replace("2.1e5", "2.1e8").replace("e-9", "e-6").replace("1e-7", "1e-4")


def faults(text: str, overrides: tuple[str, ...] = ()) -> tuple[Fault, ...]:
    """Return the faults of a case."""
    try:
        read_case_text(text, overrides)
    except CaseError as error:
        return tuple(error.faults)
    return ()


@pytest.mark.parametrize("units", ["mm-t-s", "mm-kg-s"])
@pytest.mark.parametrize("kind", SPOILED)
@given(share=st.floats(0.0, 1.0))
def test_faults_are_in_the_numbers_of_the_file_and_advice_mends_them(kind: str, units: str, share: float) -> None:
    """What was typed is what was found; no metre and no question about mm; `key = value` can be typed as it stands."""
    good, line, (least, most) = SPOILED[kind]
    typed = f"{least + share * (most - least):.4g}"
    text = in_units(units)
    assert not faults(text)
    spoiled = text.replace(good, line.format(typed), 1)
    assert spoiled != text
    found = faults(spoiled)
    assert found
    words = "\n".join(map(str, found))
    assert not re.search(r"\d m(?![\w/^])|in m\b(?!m)|is it in mm", words), words
    numbers = [abs(float(one)) for one in re.findall(r"(?<![\w.])[-+]?[\d.]+(?:e[-+]?\d+)?", words)]
    assert any(one == pytest.approx(float(typed), rel=1e-6) for one in numbers), words
    advice = re.search(r"\b(\w+) = ([-\d.e+]+)", found[0].hint)
    if advice and advice[1] in LENGTHS:
        mended = spoiled.replace(line.format(typed).strip(), f"{advice[1]} = {advice[2]}", 1)
        assert not faults(mended), (words, faults(mended))


def test_overrides_and_files_in_si_keep_their_words() -> None:
    """`--set` takes SI in any file; a file in SI has faults in SI."""
    text = in_units("mm-t-s")
    (fault,) = faults(text, ("joint.j.point=0.9",))
    assert "x = 0.9 m" in fault.found
    si = text.replace("mm-t-s", "m-kg-s")  # the same numbers in m: a beam of 510 m
    (fault,) = faults(si.replace("point = 0\n", "point = 900\n"))
    assert "x = 900 m" in fault.found


@given(low=st.floats(0.21, 5.0))
def test_advice_on_the_range_of_a_curve_has_the_unit_of_its_key(low: float) -> None:
    """Low and high have the unit of another key: the clearance, 0.2 mm in the file."""
    curve = (
        '[model]\ntype = "beam"\n[analysis]\ntype = "periodic"\n[analysis.continuation]\nkey = "support.clearance"\n'
    )
    text = in_units("mm-t-s", PLAIN) + curve + f"low = {low}\nhigh = {low + 1.0}\n"
    (fault,) = faults(text)
    advised = re.search(r"low = ([\d.]+), high = ([\d.]+)", fault.hint)
    assert advised
    assert not faults(text.replace(f"low = {low}", f"low = {advised[1]}"))


CURVES = {  # key and its value in the file
    "support.clearance": 0.2,
    "contact.stiffness": 500.0,
    "load.force.amplitude": 20.0,
    "load.force.frequency": 20.0,
}


@pytest.mark.parametrize("kind", ["above", "below", "swapped"])
@pytest.mark.parametrize("key", CURVES)
@given(share=st.floats(1.2, 30.0))
def test_ranges_of_curves_are_quoted_as_typed(key: str, kind: str, share: float) -> None:
    """Numbers without a unit word are those of the file, too: the range, and the value of the case beside it."""
    value = CURVES[key]
    text = in_units("mm-t-s", PLAIN) + "contact = { stiffness = 500 }\n"
    curve = f'[model]\ntype = "beam"\n[analysis]\ntype = "periodic"\n[analysis.continuation]\nkey = "{key}"\n'
    low, high = {
        "above": (value * share, 2.0 * value * share),
        "below": (0.5 * value / share, value / share),
        "swapped": (value * share, value / share),
    }[kind]
    low, high = float(f"{low:.4g}"), float(f"{high:.4g}")
    (fault,) = faults(text + curve + f"low = {low}\nhigh = {high}\n")
    words = f"{fault.found} {fault.expected}"
    numbers = [float(one) for one in re.findall(r"(?<![\w.])[-+]?[\d.]+(?:e[-+]?\d+)?(?![\w])", words)]
    asked = {low, high} | (set() if kind == "swapped" else {value})
    assert {float(f"{one:.4g}") for one in numbers} == asked, words
