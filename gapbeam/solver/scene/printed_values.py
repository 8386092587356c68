"""Words of values in a Python session: laws, regions and loads in a line, arrays of results as shapes and ranges."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

FEW = 4
"""Numbers or names up to which all are shown."""


def result_words(result: Any) -> str:
    """Return a dataclass with a line for each attribute; arrays of many numbers as their shape and range."""
    lines = [f"{one.name}: {_words(getattr(result, one.name))}" for one in fields(result)]
    return "\n  ".join([f"<{type(result).__name__}", *lines]) + ">"


def called(one: Any) -> str:
    """Return a law or a region as it is made: its kind with its values by name."""
    pairs = zip(getattr(one.kind, "given", one.kind.names), one.values, strict=False)
    named = ", ".join(f"{name}={_words(value)}" for name, value in pairs)
    return f"{one.kind.name}({named or _words(one.values)})"


def load_words(one: Any) -> str:
    """Return a load in one line: its kind, name and structure, and its value."""
    return f"<{type(one).__name__} {one.name or '?'} on {one.structure.name or '?'}: {value_of_load(one)}>"


def _words(value: Any) -> str:
    if isinstance(value, Mapping):
        parts = [f"{key} {_words(one)}" for key, one in list(value.items())[:FEW]]
        more = [f"... {len(value)} in all"] if len(value) > FEW else []
        return ", ".join([*parts, *more]) or "none"
    if is_dataclass(value) or (isinstance(value, (list, tuple)) and any(map(is_dataclass, value))):
        return type(value).__name__ if is_dataclass(value) else f"{len(value)} of {type(value[0]).__name__}"
    array = np.asarray(value)
    if array.dtype.kind not in "biufc":
        return repr(value)
    shape = str(array.shape).replace(",)", ")")
    if array.size <= FEW:
        numbers = ", ".join(str(one) if array.dtype.kind == "b" else f"{one:.6g}" for one in array.ravel())
        return f"{shape} {numbers}".rstrip() if array.ndim else numbers
    if array.dtype.kind == "b":
        return f"{shape} {int(array.sum())} of {array.size} true"
    known = array[np.isfinite(array)]
    sizes, of = (np.abs(known), "absolute ") if array.dtype.kind == "c" else (known, "")
    span = f" {of}{sizes.min():.6g} to {sizes.max():.6g}" if known.size else ""
    lost = f", {array.size - known.size} not finite" if known.size < array.size else ""
    return f"{shape}{span}{lost}"


def value_of_load(one: Any) -> str:
    """Return the value of a load with its unit, or its function with the parameters."""
    if isinstance(one.value, tuple):
        times = one.value[0]
        return f"table from {times[0]:.4g} to {times[-1]:.4g} s"
    if not callable(one.value):
        return f"{_number(one.value)} {one.unit}".rstrip()
    name = getattr(one.value, "__name__", "function of time")
    return ": ".join([name, *([listed(one.parameters, [list(one.parameters.values())])] if one.parameters else [])])


def listed(names: Iterable[str], values: Iterable[Sequence[Any]]) -> str:
    """Return names with their numbers, or with the ranges of these over contacts and members of an ensemble."""
    ranges = zip(names, zip(*values, strict=True), strict=True)
    return ", ".join(f"{name} {_number(np.concatenate([np.ravel(one) for one in many]))}" for name, many in ranges)


def _number(value: Any) -> str:
    if np.asarray(value).dtype.kind not in "biuf":
        return "given"
    low, high = float(np.min(value)), float(np.max(value))
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
