"""Magnitudes of numbers: beyond the limits their squares and products would overflow or vanish."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from gapbeam.solver.case.reading.known_keys import candidates
from gapbeam.solver.case.reading.value_words import shown
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.table import Positive

LARGEST = 1.0e30
SMALLEST = 1.0e-30
"""Least value of positive numbers that others are divided by."""


def beyond_reason(data: Mapping[str, Any]) -> list[Fault]:
    """Return a fault for every key whose number, or one of whose list, is beyond all reason in SI units.

    Args:
        data: The case file as read.
    """
    hint = "all values are in SI units, Hz and degrees"
    faults = []
    for key, value in _numbers((), data):
        if abs(value) > LARGEST:
            faults.append(Fault(key, shown(value), f"at most {LARGEST:g} in size", hint))
        elif 0.0 < value < SMALLEST and _is_positive(key, data):
            faults.append(Fault(key, shown(value), f"at least {SMALLEST:g}", hint))
    return faults


def _numbers(key: Key, value: Any) -> Iterator[tuple[Key, float]]:
    """Yield the numbers in a value, each with the key that it stands behind."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            yield from _numbers((*key, name), entry)
    elif isinstance(value, list | tuple):
        for number, entry in enumerate(value):
            yield from _numbers((*key, number) if isinstance(entry, Mapping) else key, entry)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield key, value


def _is_positive(key: Key, data: Mapping[str, Any]) -> bool:
    """Return whether a key holds a number above 0, or none."""
    fields = [model.model_fields.get(str(key[-1])) for model in candidates(key[:-1], data)]
    return any(
        Positive in get_args(field.annotation) or any(getattr(entry, "gt", None) == 0 for entry in field.metadata)
        for field in fields
        if field is not None
    )
