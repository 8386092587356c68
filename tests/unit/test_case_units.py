"""The key `units`: a case in mm, t and s is the case in SI, and values that look like mm and MPa stop a run."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.json_schema import unit_in
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.reading.known_keys import tables
from gapbeam.solver.case.reading.overrides import UNITS, convert, factor_of, override, size_of, slips, unit_of_key
from gapbeam.solver.messages.errors import CaseError

PROJECT = Path(__file__).parents[2]
IN_SI = """
[beam]
length = 0.51
thickness = 0.012
width = 0.02
[material]
young_modulus = 2.1e11
poisson_ratio = 0.3
density = 7850.0
[support]
length = 0.05
clearance = 1.0e-4
[contact]
stiffness = 1.0e13
damping = 1.0e9
[[load]]
type = "gravity"
acceleration = 9.8
[[load]]
type = "harmonic_force"
name = "shaker"
point = 0.3
amplitude = 5.0
frequency = 20.0
[[load]]
type = "base_motion"
name = "floor"
quantity = "displacement"
amplitude = 1.0e-3
frequency = 20.0
[[mass]]
name = "tip"
point = 0.5
mass = 0.2
polar_inertia = 3.0e-5
[[probe]]
name = "tip"
point = [0.5, 0.0]
[time]
end = 0.1
"""
IN_MM = """
[beam]
length = 510
thickness = 12.0
width = 20
[material]
young_modulus = 2.1e5
poisson_ratio = 0.3
density = 7.85e-9
[support]
length = 50.0
clearance = 0.1
[contact]
stiffness = 1.0e4
damping = 1.0
[[load]]
type = "gravity"
acceleration = 9.8e3
[[load]]
type = "harmonic_force"
name = "shaker"
point = 300.0
amplitude = 5.0
frequency = 20.0
[[load]]
type = "base_motion"
name = "floor"
quantity = "displacement"
amplitude = 1.0
frequency = 20.0
[[mass]]
name = "tip"
point = 500.0
mass = 0.2e-3
polar_inertia = 3.0e-2
[[probe]]
name = "tip"
point = [500.0, 0.0]
[time]
end = 0.1
"""
IN_KG = (
    IN_MM.replace("2.1e5", "2.1e8").replace("7.85e-9", "7.85e-6").replace("amplitude = 5.0", "amplitude = 5.0e3")
    .replace("mass = 0.2e-3", "mass = 0.2").replace("3.0e-2", "30.0")
)  # fmt: skip


def close(one: object, other: object) -> bool:
    """Return whether two tables hold the same numbers to round-off."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(close(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(close, one, other))
    return one == pytest.approx(other, rel=1e-14) if isinstance(one, float) else one == other


def test_a_case_in_millimeters_is_the_case_in_si() -> None:
    """Both written by hand; overrides and the case that a run leaves are SI."""
    plain, converted = read_case_text(IN_SI), read_case_text('units = "mm-t-s"' + IN_MM)
    assert converted.units == "m-kg-s"
    assert close(plain.model_dump(), converted.model_dump() | {"units": None})
    assert read_case_text(case_to_toml(converted)) == converted
    wider = read_case_text('units = "mm-t-s"' + IN_MM, {"support.clearance": 2e-4})
    assert wider.layout.clearance == 2e-4


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("m", 1e-3), ("N", 1.0), ("Pa", 1e6), ("kg/m^3", 1e12), ("Pa/m", 1e9), ("Pa s/m", 1e9), ("N/m", 1e3),
        ("N s/m", 1e3), ("1/Pa", 1e-6), ("m^2", 1e-6), ("kg m^2", 1e-3), ("kg/m", 1e6), ("N s/m^2", 1e6),
        ("N m/rad", 1e-3), ("N m s/rad", 1e-3), ("m/s^2", 1e-3), ("m/s", 1e-3), ("Hz", 1.0), ("degrees", 1.0),
        ("m/s^2, m/s or m", 1e-3), ("N or m/s^2", None), ("N^2/Hz or (m/s^2)^2/Hz", None), ("", 1.0),
        ("(m/s^2)^2/Hz", 1e-6), ("(N/m)^2/Hz", 1e6),
    ],
)  # fmt: skip
def test_factors_of_units(unit: str, factor: float | None) -> None:
    """From mm, t, s: N and MPa are its force and stress."""
    assert factor_of(unit, "mm-t-s") == (None if factor is None else pytest.approx(factor))
    assert factor_of(unit, "m-kg-s") == 1.0


def test_every_number_of_a_case_has_a_unit() -> None:
    """So that none is left as it is by mistake."""
    for table in tables():
        for name, field in table.model.model_fields.items():
            kind = str(field.annotation)
            if "float" in kind or "Number" in kind or "Positive" in kind:
                assert unit_in(field.description or ""), (table, name)


POINTS = "[contact]\npoints = [0.0, POINT]\nstiffness = {}\n"
LAW = 'law = {{ type = "hunt-crossley", exponent = EXPONENT, restitution = 0.5 }}\n'
NOISE = '[[load]]\ntype = "random"\nname = "n"\nspectrum = {{ type = "white", high = 90.0, density = {} }}\n'
SWEEP = '[[load]]\ntype = "swept-sine"\nname = "n"\nstart_frequency = 5.0\nend_frequency = 9.0\n'
SWEEP += "duration = 0.1\namplitude = {}\n"
FORCE, ACCELERATION = "point = POINT\n", 'quantity = "acceleration"\n'
DEPENDING = {
    "exponent": ("[contact]\nstiffness = {}\n" + LAW, 1.0, lambda n: -1.0 - n),
    "exponent by default": (
        "[contact]\nstiffness = {}\n"
        + LAW.replace("exponent = EXPONENT, ", "").replace("hunt-crossley", "lankarani-nikravesh"),
        1.0,
        lambda _: -2.5,
    ),
    "points": (POINTS, 1.0, lambda _: 0.0),
    "points, exponent": (POINTS + LAW, 1.0, lambda n: 1.0 - n),
    "damper of points": ("[contact]\npoints = [0.0, POINT]\ndamping = {}\n", 1.0, lambda _: 0.0),
    "noise of a force": (NOISE + FORCE, 2.0, lambda _: 2.0),
    "noise of an acceleration": (NOISE + ACCELERATION, 0.0, lambda _: 2.0),
    "sweep of a force": (SWEEP + FORCE, 1.0, lambda _: 1.0),
    "sweep of an acceleration": (SWEEP + ACCELERATION, 0.0, lambda _: 1.0),
}


@pytest.mark.parametrize("units", ["mm-t-s", "mm-kg-s"])
@pytest.mark.parametrize("kind", DEPENDING)
@given(number=st.floats(1.0, 1.0e4), exponent=st.floats(1.0, 3.0))
def test_a_unit_that_depends_on_other_keys_is_converted(kind: str, units: str, number: float, exponent: float) -> None:
    """By the exponent of the law, by points or faces, by the quantity of a load: kg^a m^b, by dimensional analysis."""
    text, masses, lengths = DEPENDING[kind]
    length, mass = UNITS[units]
    other = IN_MM if units == "mm-t-s" else IN_KG
    text = text.replace("EXPONENT", repr(exponent))
    in_si = text.format(number * length ** lengths(exponent) * mass**masses).replace("POINT", "0.05")
    plain = read_case_text(without_contact(IN_SI) + in_si)
    converted = read_case_text(
        f'units = "{units}"' + without_contact(other) + text.format(number).replace("POINT", "50")
    )
    assert close(plain.model_dump(), converted.model_dump() | {"units": None})


def without_contact(text: str) -> str:
    """Return the text of a case without [contact]."""
    return text[: text.index("[contact]")] + text[text.index("[[load]]") :]


@pytest.mark.parametrize("text", [NOISE.replace("high =", "scale = 96.17, high =") + ACCELERATION])
def test_a_unit_that_is_not_known_is_refused(text: str) -> None:
    """Densities with a factor have a unit of their own, such as g^2/Hz."""
    with pytest.raises(CaseError) as refused:
        read_case_text('units = "mm-t-s"' + IN_MM + text.format(1.0))
    assert "density" in str(refused.value)
    assert "a key with one unit" in str(refused.value)


@pytest.mark.parametrize(
    ("quantity", "place", "factor"),
    [
        ("displacement", "tip", 1e-3), ("acceleration_absolute", "tip", 1e-3), ("impulse", "gland", 1e-3),
        ("contact_force", "gland", 1e-3), ("penetration", "gland", 1e-3), ("kinetic_energy", None, 1e-6),
    ],
)  # fmt: skip
def test_the_limit_of_a_figure_has_the_unit_of_its_quantity(quantity: str, place: str | None, factor: float) -> None:
    """In mm, kg and s; a figure whose quantity does not exist is refused by that alone."""
    where = "" if place is None else f'place = "{place}"\n'
    figure = f'[[figure]]\nname = "late"\nquantity = "{quantity}"\n{where}statistic = "share"\nlimit = 0.3\n'
    case = read_case_text('units = "mm-kg-s"' + IN_KG + figure)
    assert case.figure[0].limit == pytest.approx(0.3 * factor)
    with pytest.raises(CaseError) as caught:
        read_case_text('units = "mm-kg-s"' + IN_KG + figure.replace(quantity, "speed_of_sound"))
    assert [one.key[-1] for one in caught.value.faults] == ["quantity"]


@pytest.mark.parametrize(
    ("key", "low", "factor"),
    [
        ("load.shaker.frequency", 15.0, 1.0), ("support.clearance", 0.1, 1e-3), ("contact.stiffness", 1e4, 1e6),
        ("load.shaker.amplitude", 5e3, 1e-3),
    ],
)  # fmt: skip
def test_the_range_of_a_curve_has_the_unit_of_its_key(key: str, low: float, factor: float) -> None:
    """In mm, kg and s."""
    motion, *loads = IN_KG.partition("[[load]]\nname")[0].partition('[[load]]\ntype = "base_motion"')
    assert loads
    curve = f'key = "{key}"\nlow = {low}\nhigh = {2.0 * low}\n'
    rest = (
        motion
        + '[model]\ntype = "beam"\n[time]\nend = 0.05\n[analysis]\ntype = "periodic"\n[analysis.continuation]\n'
        + curve
    )
    case = read_case_text('units = "mm-kg-s"' + rest)
    assert case.analysis.continuation.low == pytest.approx(low * factor)


def test_millimeters_and_megapascals_stop_a_run() -> None:
    """By the sum of unlikely values; one alone is asked about; who writes the units is believed."""
    with pytest.raises(CaseError) as refused:
        read_case_text(IN_MM)
    (fault,) = refused.value.faults
    assert "length = 510 m" in fault.found
    assert "these look like mm and MPa" in fault.found
    assert 'units = "mm-t-s"' in fault.hint
    with pytest.raises(CaseError) as refused:  # a density in kg/m^3 does not go with mm-t-s, and the advice says so
        read_case_text(IN_MM.replace("density = 7.85e-9", "density = 7850.0"))
    assert "density in t/mm^3, 7.85e-09" in refused.value.faults[0].hint
    assert read_case_text(IN_SI.replace("length = 0.51\n", "length = 120.0\n")).beam.length == 120.0
    soft = IN_SI.replace("2.1e11", "2.1e7").replace("stiffness = 1.0e13\ndamping = 1.0e9\n", "stiffness = 1e9\n")
    assert read_case_text(soft).material.young_modulus == 2.1e7
    large = 'units = "m-kg-s"' + soft.replace("length = 0.51\n", "length = 120.0\n")
    assert read_case_text(large).units == "m-kg-s"
    for unknown in ('units = "mm"', "units = 3"):
        with pytest.raises(CaseError, match=r"units") as refused:
            read_case_text(unknown + IN_SI)
        assert "mm-t-s" in str(refused.value)


def test_shipped_cases_do_not_look_like_millimeters() -> None:
    """None of them is stopped."""
    assert set(UNITS) == {"m-kg-s", "mm-t-s", "mm-kg-s"}
    for file in sorted((PROJECT / "cases").glob("*.toml")):
        assert gapbeam.read_case(file).units is None


def test_the_step_is_chosen_where_none_is_given() -> None:
    """Nobody has to guess."""
    assert read_case_text(IN_SI).time.step == "auto"


LIKELY = {
    "support.clearance": 1e-4,
    "beam.length": 0.51,
    "material.young_modulus": 2.1e11,
    "contact.stiffness": 1.0e13,
    "load.shaker.point": 0.3,
    "load.floor.amplitude": 1.0e-3,
    "mass.tip.polar_inertia": 3.0e-5,
}


@given(st.sampled_from(sorted(LIKELY)), st.floats(0.2, 5.0), st.booleans())
def test_an_override_in_the_units_of_the_file_is_asked_about(key: str, factor: float, slipped: bool) -> None:
    """Overrides are SI: 0.1 for 0.1 mm is 100 mm, and was taken without a word."""
    before = tomllib.loads('units = "mm-t-s"' + IN_MM)
    assert convert(before) == []
    after = copy.deepcopy(before)
    place = next(iter(override(after, {key: 1.0})[0]))
    size = size_of(place, before, "mm-t-s")
    assert size is not None
    typed, _ = override(after, {key: LIKELY[key] * factor / (size if slipped else 1.0)})
    found = list(slips(before, after, typed, "mm-t-s"))
    assert len(found) == slipped
    assert all(f"in the units of the file is {LIKELY[key] * factor:g} " in words for words in found)


@pytest.mark.parametrize(
    ("quantity", "unit"), [(None, "m/s^2"), ("acceleration", "m/s^2"), ("velocity", "m/s"), ("displacement", "m")]
)
def test_the_amplitude_of_a_motion_has_the_unit_of_its_quantity(quantity: str | None, unit: str) -> None:
    """Axes and columns of studies named all three units."""
    load = {"type": "base_motion", "name": "table", "amplitude": 1.0} | (
        {} if quantity is None else {"quantity": quantity}
    )
    assert unit_of_key("load.table.amplitude", {"load": [load]}) == unit
