"""Exponents by which quantities grow with the size of a scene of constant Young's modulus and density.

Lengths and times grow in proportion to the size s, masses by s^3. Every unit follows: N = kg m/s^2 by s^2, Pa by s^0,
Hz by s^-1.
"""

from __future__ import annotations

import re

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
