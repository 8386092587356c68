"""Cases of other sizes: every key has a unit, by which it scales, and motion, messages and status stay the same."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.checks.case_warnings import unusual_loads
from gapbeam.solver.case.json_schema import OF_KEY, OF_QUANTITY, UNITS, unit_in
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.reading.known_keys import tables
from gapbeam.solver.case.solution_tables import ModelTable
from gapbeam.solver.contact.laws.law_choice import LAWS
from gapbeam.solver.schema.table import models_in, type_name
from tests.shared.case_texts import BEAM
from tests.shared.scaled_cases import (
    AT_ROUND_OFF,
    CHOSEN,
    OF_EARTH,
    SIMILAR_CASES,
    SIZES,
    SimilarCase,
    difference,
    largest,
    motion,
    scaled_case,
    size_exponent,
    unit_of,
)

SEVERAL = ("m/s^2, m/s or m", "N or m/s^2", "N^2/Hz or (m/s^2)^2/Hz", OF_KEY, OF_QUANTITY)
"""Units that another key decides."""


@pytest.mark.parametrize(
    ("unit", "exponent"),
    [("N", 2), ("Pa", 0), ("Pa/m", -1), ("Pa/m^2.2", -2.2), ("N s/m", 2), ("Pa s/m", 0), ("1/s", -1), ("kg/m^3", 0),
     ("m/s^2", -1), ("m/s", 0), ("N m/rad", 3), ("(m/s^2)^2/Hz", -1), ("(N/m)^2/Hz", 3), ("N/m^1.5", 0.5), ("1", 0)],
)  # fmt: skip
def test_exponents_of_units(unit: str, exponent: float) -> None:
    """By hand, with a mass that grows by s^3 and a time that grows by s."""
    assert size_exponent(unit) == pytest.approx(exponent)


def numbers() -> Iterator[tuple[type[Any], str]]:
    """Yield the table and name of every key of a case that takes a number that is no count."""
    for table in tables():
        for key, field in table.model.model_fields.items():
            if _holds_floats(field.annotation):
                yield table.model, key


def _holds_floats(annotation: object) -> bool:
    return annotation is float or any(_holds_floats(part) for part in get_args(annotation))


@pytest.mark.parametrize("unit", [unit for unit in UNITS if unit not in SEVERAL])
def test_every_unit_of_a_key_can_be_scaled(unit: str) -> None:
    """A unit that descriptions may end with is one that the exponents know."""
    size_exponent(unit)


def test_every_number_has_a_unit() -> None:
    """A new key has a unit in its description, or says by which other key its unit is chosen."""
    unknown = []
    for model, key in numbers():
        unit = unit_in(model.model_fields[key].description or "")
        chosen = any((base.__name__, key) in CHOSEN for base in model.__mro__)
        if not chosen and (not unit or unit in SEVERAL):
            unknown.append(f"{model.__name__}.{key}")
    assert unknown == []


def test_no_default_has_a_size() -> None:
    """A default that is a number with a unit would be right at one size only; gravity is a number of the Earth."""
    sized = []
    for model, key in numbers():
        default = model.model_fields[key].default
        chosen = any((base.__name__, key) in CHOSEN for base in model.__mro__)
        known = key in OF_EARTH.get(model.__name__, ()) or chosen
        unit = unit_in(model.model_fields[key].description or "")
        if isinstance(default, float) and default != 0.0 and not known and size_exponent(unit) != 0.0:
            sized.append(f"{model.__name__}.{key} = {default:g}")
    assert sized == []


def test_units_that_other_keys_choose() -> None:
    """K of a law by its exponent, of a point by the point; gravity, that nobody wrote, scales."""
    case = read_case_text(
        BEAM + "[support]\nlength = 0.05\nclearance = 1e-4\n[contact]\nstiffness = 1e13\n"
        '[contact.law]\ntype = "hunt-crossley"\nexponent = 1.5\nrestitution = 0.6\n'
    )
    assert unit_of(case, (case, case.contact), "stiffness") == "Pa/m^1.5"
    small = scaled_case(case, 0.25)
    assert small.contact.stiffness == 1e13 * 0.25**-1.5
    assert small.load[0].peak == 9.81 * 4.0
    assert small.material == case.material


@pytest.mark.parametrize("size", [2.0**-20, 2.0**-10, 1.0, 2.0**10])
def test_hard_shaking_is_asked_about_at_any_size(size: float) -> None:
    """Also of MEMS that 10 000 g do not harm, and of a tower that 100 g would."""
    text = BEAM + "[support]\nlength = 0.05\nclearance = 1e-4\n" + '[[load]]\ntype = "base_motion"\nfrequency = 20.0\n'
    soft, hard = (scaled_case(read_case_text(f"{text}amplitude = {a}\n"), size) for a in (1e3, 1e5))
    assert not any("wave speed" in line for line in unusual_loads(soft))
    assert any("wave speed" in line for line in unusual_loads(hard))


def test_the_cases_cover_models_and_laws() -> None:
    """Every model and every contact law is among the cases."""
    cases = [one.case() for one in SIMILAR_CASES]
    models = {type_name(type(case.model)) for case in cases}
    assert models >= {type_name(one) for one in models_in(ModelTable)} - {"auto"}
    laws = {type_name(type(case.contact.law)) for case in cases}
    assert laws >= set(LAWS)
    assert any(getattr(case.model, "rings", None) is not None for case in cases)


def compare(one: SimilarCase, folder: Path, sizes: tuple[float, ...]) -> None:
    """Run a case at two or more sizes and compare what it says and how it moves."""
    case = one.case()
    unit = motion(case, 1.0, folder / "1")
    for size in sizes:
        other = motion(case, size, folder / "s")
        assert other.status == unit.status
        assert other.message == unit.message
        assert other.lines == unit.lines
        apart = {
            name: off
            for name, values in unit.history.items()
            if name not in (() if one.to_the_last_bit else AT_ROUND_OFF)
            and (off := difference(values, other.history[name], largest(unit, name)))
            > (0.0 if one.to_the_last_bit else one.within)
        }
        assert apart == {}, f"at {size:g} of the size"


@pytest.mark.parametrize("one", [one for one in SIMILAR_CASES if one.fast], ids=lambda one: one.name)
def test_a_small_scene_moves_as_a_large_one(one: SimilarCase, tmp_path: Path) -> None:
    """At 2^-14 of the size."""
    compare(one, tmp_path, SIZES[:1])


def bouncing(slower: float, thickness: float = 0.02, clearance: float = 1e-4) -> dict[str, Any]:
    """Return a rigid body that comes to rest on supports by bounces, in a time that passes more slowly."""
    square = slower**2
    return {
        "beam": {"length": 0.5, "thickness": thickness, "width": 0.02},
        "material": {"young_modulus": 2.1e11 / square, "poisson_ratio": 0.3, "density": 7850.0},
        "damping": {"mass": 0.0, "stiffness": 0.0},
        "support": [{"name": "s", "from": 0.1, "to": 0.4, "clearance": clearance}],
        "model": {"type": "rigid"},
        "contact": {"stiffness": 1e12 / square, "law": {"type": "hunt-crossley", "exponent": 1.5, "restitution": 0.3}},
        "load": [{"type": "gravity", "acceleration": 9.81 / square}],
        "probe": [{"name": "tip", "point": 0.5}],
        "analysis": {"type": "transient", "start": "undeformed"},
        "time": {"end": 0.02 * slower, "step": 2e-5 * slower},
        "output": {"errors": "none"},
    }


def test_a_slow_scene_moves_as_a_fast_one(tmp_path: Path) -> None:
    """A time that passes 1024 times as slowly changes no place, and no speed below which touches count as equal."""
    runs = [
        gapbeam.run(gapbeam.read_case(bouncing(slower)), output=tmp_path / f"{slower:g}", overwrite=True)
        for slower in (1.0, 1024.0)
    ]
    assert [run.exit_status for run in runs] == [0, 0]
    fast, slow = (
        np.asarray(gapbeam.open_results(tmp_path / f"{slower:g}").history["displacement"]) for slower in (1.0, 1024.0)
    )
    assert np.ptp(fast) > 1e-5
    assert fast == pytest.approx(slow, abs=1e-9 * np.ptp(fast))


@pytest.mark.slow(minutes=0.4)
@pytest.mark.parametrize("one", SIMILAR_CASES, ids=lambda one: one.name)
def test_scenes_of_all_sizes_move_alike(one: SimilarCase, tmp_path: Path) -> None:
    """At 2^-14 and 2^10 of the size."""
    compare(one, tmp_path, SIZES)
