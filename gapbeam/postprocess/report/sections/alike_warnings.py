"""Warnings that say the same of several signals, as one: their names, then the words, with the span of each number."""

from __future__ import annotations

import re
from collections.abc import Sequence

_SIGNAL = re.compile(r"((?:[^:]+: )?(?:smoothed acceleration|acceleration|velocity|displacement)): (.+)", re.DOTALL)
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def alike(texts: Sequence[str]) -> list[str]:
    """Return warnings in their order, those that differ by their signal and by numbers alone as one.

    Args:
        texts: "velocity: lines of 2 % ...", "tip: acceleration: lines of 50 % ...", or anything else.
    """
    found: dict[str, tuple[list[str], list[list[str]]]] = {}
    for text in texts:
        match = _SIGNAL.fullmatch(text)
        name, rest = (match[1], match[2]) if match else ("", text)
        key = _NUMBER.sub("\0", rest) if name else f"\n{text}"
        names, numbers = found.setdefault(key, ([], []))
        names.append(name.replace(": ", " "))
        numbers.append(_NUMBER.findall(rest))
    return [_joined(key, names, numbers) if names[0] else key[1:] for key, (names, numbers) in found.items()]


def _joined(key: str, names: Sequence[str], numbers: Sequence[Sequence[str]]) -> str:
    spans = iter([_span(list(column)) for column in zip(*numbers, strict=True)])
    return f"{', '.join(names)}: {re.sub(chr(0), lambda _: next(spans), key)}"


def _span(values: Sequence[str]) -> str:
    """Return a number, or the smallest and the largest of several."""
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"
