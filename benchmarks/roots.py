"""Roots of the frequency equation against the determinant that the paper prints, at 50 digits, over a grid of springs.

environment/run python3 -m benchmarks.roots

The determinant is that of Eq. 8 with its rows times k1 and k2, so that springs of 0 and infinity have a place. Its
roots are bracketed by its signs on a fine scale of lambda and found by mpmath, independent of the code in question.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mpmath
import numpy as np

from gapbeam.studies.modes.beam_theory import SpringBeam

DIGITS = 50
SURE = mpmath.mpf("1e-30")  # of a root found, beside which the sign is seen to change
BEAM = SpringBeam(length=0.46, bending=2.1e11 * 0.02 * 0.012**3 / 12.0, mass=7919.0 * 0.02 * 0.012)
SPRINGS = (0.0, *np.logspace(-2.0, 12.0, 38), np.inf)
MODES = 10
LIMIT = 1.0e-10
START, RATIO, STEP = (
    1e-3,
    1.5,
    0.25,
)  # of the scale; roots lie a factor of 1.9 apart near 0, and a distance of 1.5 beyond


@dataclass(frozen=True)
class Agreement:
    """Largest deviations of compared roots.

    Attributes:
        roots: Number of compared roots, zeros included.
        worst: The largest deviation, relative, and absolute for roots below 1.
        of_first_three: The same of the first three.
        missed: Pairs of springs for which the number of roots below the last one differs.
    """

    roots: int
    worst: float
    of_first_three: float
    missed: tuple[tuple[float, float], ...]


def printed_determinant(root: mpmath.mpf, draught: float, torsion: float, beam: SpringBeam) -> mpmath.mpf:
    """Return the determinant of Eq. 8 at lambda, its first row times k1 and its second times k2."""
    beta, bending = root / mpmath.mpf(beam.length), mpmath.mpf(beam.bending)
    shear, moment = bending * beta**3, bending * beta
    first = [0, 1, 0, 1] if np.isinf(draught) else [-shear, mpmath.mpf(draught), shear, mpmath.mpf(draught)]
    second = [1, 0, 1, 0] if np.isinf(torsion) else [mpmath.mpf(torsion), moment, mpmath.mpf(torsion), -moment]
    c, s, ch, sh = mpmath.cos(root), mpmath.sin(root), mpmath.cosh(root), mpmath.sinh(root)
    return mpmath.det(mpmath.matrix([first, second, [-s, -c, sh, ch], [-c, s, ch, sh]]))


def independent_roots(draught: float, torsion: float, modes: int, beam: SpringBeam) -> list[mpmath.mpf]:
    """Return the first roots by signs on a scale and mpmath; a spring of 0 gives a root that is 0."""
    found = [mpmath.mpf(0)] * [draught, torsion].count(0.0)

    def function(root: mpmath.mpf) -> mpmath.mpf:
        return printed_determinant(root, draught, torsion, beam)

    scale = _scale()
    low = next(scale)
    before = function(low)
    while len(found) < modes:
        high = next(scale)
        after = function(high)
        if before * after < 0:
            root = mpmath.findroot(function, (low, high), solver="anderson", tol=SURE, verify=False)
            assert function(root * (1 - 10 * SURE)) * function(root * (1 + 10 * SURE)) < 0, "findroot failed"
            found.append(root)
        low, before = high, after
    return found[:modes]


def _scale() -> Iterator[mpmath.mpf]:
    place = mpmath.mpf(START)
    while True:
        yield place
        place = min(place * RATIO, place + STEP)


def compare(springs: Sequence[float], modes: int, beam: SpringBeam = BEAM) -> Agreement:
    """Compare the first roots of a beam for all pairs of springs, N/m and N m/rad."""
    ours = beam.roots(np.arange(1, modes + 1)[:, None, None], np.array(springs)[:, None], np.array(springs))
    worst, of_first_three, missed = 0.0, 0.0, []
    with mpmath.workdps(DIGITS):
        for row, draught in enumerate(springs):
            for column, torsion in enumerate(springs):
                theirs = independent_roots(draught, torsion, modes, beam)
                apart = [
                    float(abs(mpmath.mpf(float(mine)) - other) / max(other, 1))
                    for mine, other in zip(ours[:, row, column], theirs, strict=True)
                ]
                worst, of_first_three = max(worst, *apart), max(of_first_three, *apart[:3])
                if max(apart) > STEP:
                    missed.append((float(draught), float(torsion)))
    return Agreement(modes * len(springs) ** 2, worst, of_first_three, tuple(missed))


def main() -> int:
    """Compare over 40 x 40 springs and return 0, or 1 where a root is off by more than 1e-10."""
    clock = time.perf_counter()
    found = compare(SPRINGS, MODES)
    print(
        f"{found.roots} roots, {len(SPRINGS)} x {len(SPRINGS)} springs from {SPRINGS[0]:g} to {SPRINGS[-1]:g}, "
        f"modes 1 to {MODES}: largest deviation {found.worst:.1e}, of the first three {found.of_first_three:.1e}, "
        f"missed or spurious {len(found.missed)}; {time.perf_counter() - clock:.0f} s"
    )
    return 0 if found.worst <= LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
