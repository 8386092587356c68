"""A case at another size, from the units of its keys: no key is named here whose unit its description gives.

Keys that are left out stay out, so that their defaults have to find the size by themselves; but for the acceleration of
gravity on Earth, a number of its own.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np
from pydantic import BaseModel

import gapbeam
from gapbeam.solver.case.case import Case, law_at
from gapbeam.solver.case.checks.case_warnings import unit_questions, unusual_loads
from gapbeam.solver.case.figure_table import RECORDED, Figure
from gapbeam.solver.case.json_schema import unit_in
from gapbeam.solver.case.reading.case_reader import read_case, read_case_tables
from gapbeam.solver.schema.record_table import HISTORY_FILE
from gapbeam.solver.schema.table import type_name
from gapbeam.solver.supports.support_tables import OneSupport

KeyPath = tuple[str | int, ...]
Unit = Callable[[Case, tuple[BaseModel, ...]], str]

QUANTITIES = {"force": "N", "acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}
"""Quantities that the amplitude of a load may have, each with its unit."""


def _load_unit(tables: tuple[BaseModel, ...]) -> str:
    """Return the unit of the values of a load."""
    load = next(table for table in tables if hasattr(table, "place"))
    if type_name(type(load)) == "random-line-load":
        return "N/m"
    quantity = getattr(load, "quantity", None)
    if quantity is None:  # a record of a force, or of the displacement of a support
        quantity = "force" if type_name(type(load)) == "recorded_force" else "displacement"
    return QUANTITIES[quantity]


def _unit_at_support(case: Case, support: OneSupport) -> str:
    return case.contact.unit_with(law_at(case.contact, support))


def _of_key(case: Case, tables: tuple[BaseModel, ...]) -> str:
    key = tuple(int(part) if part.isdigit() else part for part in tables[-1].key.split("."))  # type: ignore[attr-defined]
    return _unit_at(case, key)


CHOSEN: dict[tuple[str, str], Unit] = {
    ("Contact", "stiffness"): lambda case, _: case.contact.stiffness_unit,
    ("Contact", "damping"): lambda case, _: case.contact.damping_unit,
    ("OneOfSeveral", "stiffness"): lambda case, tables: _unit_at_support(case, cast(OneSupport, tables[-1])),
    ("OneOfSeveral", "damping"): lambda case, _: case.contact.damping_unit,
    ("AdamsImpact", "damping"): lambda case, _: case.contact.damping_unit,
    ("ElasticPlastic", "yield_pressure"): lambda case, _: "Pa" if case.contact.points is None else "N",
    ("RecordedTable", "scale"): lambda _, tables: _load_unit(tables),
    ("RecordedTable", "time_scale"): lambda *_: "s",
    ("RecordedTable", "offset"): lambda _, tables: _load_unit(tables),
    ("BaseMotion", "amplitude"): lambda _, tables: _load_unit(tables),
    ("SweptSineLoad", "amplitude"): lambda _, tables: _load_unit(tables),
    ("TurbulenceSpectrum", "scale"): lambda _, tables: f"({_load_unit(tables)})^2/Hz",
    ("WhiteSpectrum", "density"): lambda _, tables: f"({_load_unit(tables)})^2/Hz",
    ("TableSpectrum", "densities"): lambda _, tables: f"({_load_unit(tables)})^2/Hz",
    ("Output", "checkpoint_interval"): lambda *_: "no unit",  # of the clock on the wall
    ("Output", "wall_time"): lambda *_: "no unit",
    ("Figure", "limit"): lambda _, tables: RECORDED[cast(Figure, tables[-1]).quantity].unit,
    ("Continuation", "low"): _of_key,
    ("Continuation", "high"): _of_key,
}
"""Units that follow from other keys, of tables and of those that derive from them."""

OF_EARTH = {"Gravity": ("acceleration",)}
"""Defaults that are numbers with a unit: written, so that they are scaled."""

OF_FILES = ("scale", "time_scale")
"""Keys that stand for the numbers in a file: written even where the case leaves them out."""


def unit_of(case: Case, tables: tuple[BaseModel, ...], key: str) -> str:
    """Return the unit of a key of the innermost of some tables, each inside the one before.

    Raises:
        ValueError: The description of the key ends with no unit.
    """
    model = type(tables[-1])
    for base in model.__mro__:
        if (base.__name__, key) in CHOSEN:
            return CHOSEN[base.__name__, key](case, tables)
    unit = unit_in(model.model_fields[key].description or "")
    if not unit:
        raise ValueError(f"{model.__name__}.{key} is a number whose description ends with no unit")
    return unit


def scaled_tables(case: Case, size: float) -> dict[str, Any]:
    """Return the tables of a case whose lengths are `size` times as large; a power of two rounds no number.

    Raises:
        ValueError: A number has a unit that cannot be scaled.
    """
    return _table(case, (case,), size)


def scaled_case(case: Case, size: float) -> Case:
    """Return a case whose lengths are `size` times as large."""
    return read_case_tables(scaled_tables(case, size), name="scaled")


def _table(case: Case, tables: tuple[BaseModel, ...], size: float) -> dict[str, Any]:
    table, found = tables[-1], dict[str, Any]()
    given = set(table.model_fields_set)
    given |= set(OF_EARTH.get(type(table).__name__, ()))
    if "file" in given:
        given |= set(OF_FILES) & set(type(table).model_fields)
    for key in type(table).model_fields:
        if key in given or key == "type":
            found[key] = _value(case, tables, key, vars(table)[key], size)
    return found


def _value(case: Case, tables: tuple[BaseModel, ...], key: str, value: Any, size: float) -> Any:
    if isinstance(value, BaseModel):
        return _table(case, (*tables, value), size)
    if isinstance(value, tuple):
        return [_value(case, tables, key, one, size) for one in value]
    if isinstance(value, float):
        return value * size ** size_exponent(unit_of(case, tables, key))
    return value


def _unit_at(case: Case, key: KeyPath) -> str:
    """Return the unit of a key of a case, such as ("load", 0, "frequency")."""
    tables, at = [case], case
    for part in key[:-1]:
        at = at[part] if isinstance(part, int) else getattr(at, part)  # type: ignore[index]
        tables += [at] if isinstance(at, BaseModel) else []
    return unit_of(case, tuple(tables), str(key[-1]))


BASE = {
    "m": 1.0, "s": 1.0, "kg": 3.0, "rad": 0.0, "N": 2.0, "Pa": 0.0, "J": 3.0, "W": 2.0, "Hz": -1.0,
}  # fmt: skip
"""Exponents of the units that others are written with."""

WITHOUT = ("", "1", "no unit", "degrees", "deg", "GB")
"""Units of what is the same at every size."""

_PART = re.compile(r"(?P<name>[A-Za-z]+|\(.*?\))(?:\^(?P<power>-?[\d.]+))?")


def size_exponent(unit: str) -> float:
    """Return k of a quantity that grows by s^k, from its unit, such as "N s/m^2" or "(m/s^2)^2/Hz".

    Raises:
        ValueError: A part of the unit is unknown.
    """
    if unit in WITHOUT:
        return 0.0
    sign, exponent, at = 1.0, 0.0, 0
    while at < len(unit):
        if unit[at] in " /":
            sign = -1.0 if unit[at] == "/" else sign
            at += 1
        elif unit.startswith("1/", at):
            at += 1
        elif (part := _PART.match(unit, at)) is not None:
            name, power = part["name"], float(part["power"] or 1.0)
            inner = size_exponent(name[1:-1]) if name.startswith("(") else _base(name, unit)
            exponent += sign * power * inner
            at = part.end()
        else:
            raise ValueError(f"{unit!r} cannot be read at {unit[at:]!r}")
    return exponent


def _base(name: str, unit: str) -> float:
    if name not in BASE:
        raise ValueError(f"{name!r} in {unit!r}: not a unit in {', '.join(BASE)}")
    return BASE[name]


SIZES = (2.0**-14, 2.0**10)
AT_ROUND_OFF = ("iterations", "energy_residual", "algorithmic_dissipation", "active_points", "contact_area")
"""Histories that round-off decides."""
ENERGY = ("_energy", "_work", "_dissipation")
"""Endings of histories that are energies."""

_NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")
_PREFIX = re.compile(r"# [kMGmunµ](?=(?:m|s|N|Pa|J|W|Hz)\b)")
_PROGRESS = re.compile(r"t = \S+ of ")


@dataclass(frozen=True)
class Motion:
    """Log and history of a run.

    Attributes:
        status: Exit status.
        message: Its last line, figures replaced.
        lines: Lines of its log, figures replaced.
        history: Values in the units of the size of the case, by name.
    """

    status: int
    message: str
    lines: tuple[str, ...]
    history: dict[str, np.ndarray]


def motion(case: Case, size: float, folder: Path) -> Motion:
    """Run a case at a size and return its motion in units of the size.

    Questions about units ask for what engineers usually build, and so for a size: they are left out. Lines of progress
    follow the clock.
    """
    tables = scaled_tables(case, size)
    asked = _questions(read_case_tables(tables, name="scaled"))
    lines = list[str]()

    class Kept(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if (text := record.getMessage()) not in asked and not _PROGRESS.match(text):
                lines.append(f"{record.levelname} {text}")

    handler, log = Kept(), logging.getLogger("gapbeam")
    log.addHandler(handler)
    try:
        outcome = gapbeam.run(tables, output=folder, overwrite=True)
    finally:
        log.removeHandler(handler)
    history = dict[str, np.ndarray]()
    with h5py.File(folder / HISTORY_FILE) as file:

        def keep(name: str, data: object) -> None:
            if isinstance(data, h5py.Dataset) and data.dtype.kind == "f":
                unit = str(data.attrs.get("units", "1"))
                history[name] = data[()] / size ** size_exponent(unit)

        file.visititems(keep)
    return Motion(outcome.exit_status, without_figures(outcome.message), tuple(map(without_figures, lines)), history)


def without_figures(text: str) -> str:
    """Return a text with every number replaced by #."""
    return _PREFIX.sub("# ", _NUMBER.sub("#", text))


def _questions(case: Case) -> set[str]:
    """Return the warnings of a case that ask for its units."""
    return {line for look in (unit_questions, unusual_loads) for line in look(case)}


def difference(one: np.ndarray, other: np.ndarray, scale: float) -> float:
    """Return the largest difference over a scale; without a scale the difference itself."""
    if one.shape != other.shape:
        return np.inf
    apart = float(np.max(np.abs(one - other), initial=0.0))
    return apart / scale if scale > 0.0 else apart


def largest(unit: Motion, name: str) -> float:
    """Return the scale of differences of a history: its largest value, or the largest of all energies."""
    energies = [key for key in unit.history if key.endswith(ENERGY)]
    return max(float(np.max(np.abs(unit.history[key]))) for key in (energies if name in energies else [name]))


CASES = Path(__file__).parents[2] / "cases"


@dataclass(frozen=True)
class SimilarCase:
    """A shipped case that is run at several sizes.

    Attributes:
        name: Name of its file in cases/.
        overrides: Keys that it replaces.
        end: End of the short run, s.
        to_the_last_bit: Whether all histories are the same at sizes that are powers of four: so wherever K of the law
            scales by a power of two.
        within: Otherwise allowed difference of histories, over their largest values.
        fast: Whether the fast tests have it.
    """

    name: str
    overrides: tuple[str, ...]
    end: float
    to_the_last_bit: bool = True
    within: float = 1.0e-9
    fast: bool = False

    def case(self, *, whole: bool = False) -> Case:
        """Return the case, shortened or as long as it is shipped."""
        short = () if whole else (f"time.end={self.end}", "output.errors=none")
        return read_case(CASES / f"{self.name}.toml", (*self.overrides, *short))


def _law(kind: str, **keys: float) -> str:
    return f'contact.law={{type="{kind}"' + "".join(f",{key}={value}" for key, value in keys.items()) + "}"


STIFF = "contact.stiffness=1e13"

SIMILAR_CASES = (
    SimilarCase("demo", (), 0.004),
    SimilarCase("stability", (_law("hunt-crossley", exponent=1.5, restitution=0.6), STIFF), 0.004, fast=True),
    SimilarCase("clamped", (), 0.004),
    SimilarCase("cantilever-stop", (), 0.01, fast=True),
    SimilarCase("boom", ('contact.law={type="piecewise-linear",depths=[1e-5],factors=[3.0]}',), 0.01),
    SimilarCase("sprung-stops", (_law("elastic-plastic", yield_pressure=1.0e6, hardening=0.1),), 0.02),
    SimilarCase("tube-holes", ('model={type="reduced",sections="rigid"}', "mesh.size=0.1"), 0.002),
    SimilarCase(
        "recorded",
        (_law("lankarani-nikravesh", exponent=1.5, restitution=0.6), STIFF, "contact.damping=0.0"),
        0.01,
    ),
    SimilarCase("random-vibration", (), 0.01, fast=True),
    SimilarCase("li2013-adams", (), 0.005, to_the_last_bit=False),
    SimilarCase(
        "li2013-adams", (_law("kelvin-voigt"), "contact.stiffness=1e7", "contact.damping=50"), 0.005, fast=True
    ),
)
