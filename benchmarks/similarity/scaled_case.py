"""A case at another size, from the units of its keys: no key is named here whose unit its description gives.

Keys that are left out stay out, so that their defaults have to find the size by themselves; but for the acceleration of
gravity on Earth, a number of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from pydantic import BaseModel

from benchmarks.similarity.size_exponents import size_exponent
from gapbeam.solver.case.case import Case, law_at
from gapbeam.solver.case.figure_table import RECORDED, Figure
from gapbeam.solver.case.json_schema import unit_in
from gapbeam.solver.case.reading.case_reader import read_case_tables
from gapbeam.solver.supports.support_tables import OneSupport
from gapbeam.solver.table import type_name

Path = tuple[str | int, ...]
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


def _unit_at(case: Case, key: Path) -> str:
    """Return the unit of a key of a case, such as ("load", 0, "frequency")."""
    tables, at = [case], case
    for part in key[:-1]:
        at = at[part] if isinstance(part, int) else getattr(at, part)  # type: ignore[index]
        tables += [at] if isinstance(at, BaseModel) else []
    return unit_of(case, tuple(tables), str(key[-1]))
