"""Contradictions within Rayleigh damping."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.case import Damping
from gapbeam.solver.faults import Fault


def damping_is_given_once(damping: Damping) -> Iterator[Fault]:
    """Rayleigh damping is given by frequencies and ratios, or by its two coefficients, and never by half."""
    pairs = (("frequencies", "ratios"), ("mass", "stiffness"))
    given = [name for pair in pairs for name in pair if getattr(damping, name) is not None]
    ways = [[name for name in pair if name in given] for pair in pairs]
    if all(ways):
        yield Fault(
            ("damping", given[-1]),
            f"{', '.join(given)}: damping given in two ways",
            "frequencies and ratios, or mass and stiffness",
            "remove one of the two pairs",
            tuple(("damping", name) for name in given[:-1]),
        )
        return
    for pair, way in zip(pairs, ways, strict=True):
        if len(way) == 1:
            missing = pair[1 - pair.index(way[0])]
            zero = f"; {missing} = 0.0 if there is none" if missing in pairs[1] else ""
            yield Fault(
                ("damping", way[0]),
                f"{way[0]} without {missing}",
                f"both {pair[0]} and {pair[1]}",
                f"add {missing}{zero}",
            )


def damping_is_positive(damping: Damping) -> Iterator[Fault]:
    """Two different frequencies, and ratios for which neither coefficient is negative."""
    if damping.frequencies is None or damping.ratios is None:
        return
    (low, low_ratio), (high, high_ratio) = sorted(zip(damping.frequencies, damping.ratios, strict=True))
    if low == high:
        yield Fault(
            ("damping", "frequencies"),
            f"{low:g} Hz twice",
            "two different frequencies",
            "one below and one above the frequencies of interest",
        )
        return
    least, most = low_ratio * low / high, low_ratio * high / low
    if not least * (1 - 1e-9) <= high_ratio <= most * (1 + 1e-9):
        coefficient = "mass" if high_ratio > most else "stiffness"
        yield Fault(
            ("damping", "ratios"),
            f"{low_ratio:g} at {low:g} Hz and {high_ratio:g} at {high:g} Hz: {coefficient} becomes negative",
            f"a ratio from {least:.4g} to {most:.4g} at {high:g} Hz, for {low_ratio:g} at {low:g} Hz",
            "bring the ratios closer together, or the frequencies further apart",
            (("damping", "frequencies"),),
        )
