"""Faults in the units of a file that names them: lengths in words, and the numbers of advice, are in mm there.

The checks know SI alone. What they found in a file in mm is said as the file has it, so that advice can be typed there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gapbeam.solver.case.reading.known_keys import value_at
from gapbeam.solver.case.reading.overrides import SI, UNITS, factor_of, size_of, unit_of
from gapbeam.solver.messages.errors import Fault, Key

FAR_APART = 2.0  # powers of ten between the units of a file and SI

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_NUMBERS = re.compile(rf"(?<![\w.]){_NUMBER}")
_LENGTHS = re.compile(rf"(?<![\w.]){_NUMBER}(?:(?: to | and | or |, ){_NUMBER})* m(?![\w/^])")
_ALONE = re.compile(
    rf"(?<![\w.=+-])(?<!= ){_NUMBER}(?:(?: to | and | or |, ){_NUMBER})*(?=$|[\],;:)]| (?:with|together)\b)"
)
_UNIT_ALONE = re.compile(r"\b(in |are |, )m(?=[,;)]|$)")
_SLIP = re.compile(r"is it in mm\? In m it is \S+")
_GIVEN = re.compile(rf"\b([a-z][\w.]*) = ({_NUMBER}(?!\w|\.\d)|\[[^\[\]]*\])(?! m\b)")
_AS_TYPED = re.compile(r"remove the quotes(?! and the unit)|a whole number without")


def in_file_units(faults: list[Fault], units: object, data: dict[str, Any], typed: Mapping[Key, str]) -> list[Fault]:
    """Return the faults of a file in the units that it names; those of overrides, which are SI, as they are.

    Args:
        faults: Faults in SI.
        units: The key `units` of the file; SI, nothing or no system leaves the faults as they are.
        data: The case file as read, in SI.
        typed: The keys that overrides have replaced.
    """
    if not isinstance(units, str) or units not in UNITS or UNITS[units] == UNITS[SI]:
        return faults
    return [fault if fault.key in typed else _restated(fault, units, data) for fault in faults]


def slips(before: dict[str, Any], data: dict[str, Any], typed: Mapping[Key, str], units: object) -> Iterator[str]:
    """Yield overrides, which are SI, whose numbers are about as large as those that the file has in its own units.

    Args:
        before: The case file as read, in SI.
        data: The same with overrides.
        typed: The keys that overrides have replaced, with how they were typed.
        units: The key `units` of the file.
    """
    if not isinstance(units, str) or units not in UNITS:
        return
    for key, name in typed.items():
        old, new, unit = value_at(key, before), value_at(key, data), unit_of(key, before)
        if not (unit and isinstance(old, int | float) and isinstance(new, int | float) and old and new):
            continue
        factor = factor_of(unit, units) or 1.0
        apart = abs(np.log10(factor))
        if apart >= FAR_APART and abs(np.log10(abs(new / old * factor))) < 0.5 * apart:
            yield (
                f"{name} = {new:g} is {new:g} {unit}, {abs(new / old):.3g} times the {old:g} {unit} of the file, which "
                f'has units = "{units}": overrides are SI. {new:g} in the units of the file is {new * factor:g} {unit}'
            )


def _restated(fault: Fault, units: str, data: dict[str, Any]) -> Fault:
    own = size_of(fault.key, data, units) or 1.0
    hint = _SLIP.sub("", fault.hint)

    def given(match: re.Match[str]) -> str:
        key = tuple(match[1].split("."))
        factor = size_of(key if len(key) > 1 else (*fault.key[:-1], *key), data, units) or 1.0
        return f"{match[1]} = {_divided(match[2], factor)}"

    def said(words: str) -> str:
        words = _ALONE.sub(lambda match: _divided(match[0], own), words)
        return _lengths(_GIVEN.sub(given, words), units)

    if not _AS_TYPED.match(hint):
        hint = _GIVEN.sub(given, hint)
    return replace(fault, found=said(fault.found), expected=said(fault.expected), hint=_lengths(hint, units))


def _divided(words: str, factor: float) -> str:
    return words if factor == 1.0 else _NUMBERS.sub(lambda match: f"{float(match[0]) / factor:.10g}", words)


def _lengths(words: str, units: str) -> str:
    """Return words with the lengths among them in mm."""
    words = _LENGTHS.sub(lambda match: f"{_divided(match[0][:-2], UNITS[units][0])} mm", words)
    return _UNIT_ALONE.sub(r"\1mm", words)
