"""End springs identified from frequencies that the theory itself made, and what frequencies cannot determine."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.studies.modes.beam_theory import SpringBeam
from gapbeam.studies.modes.end_springs import identify_end_springs

BEAM = SpringBeam(0.46, 2.1e11 * 0.02 * 0.012**3 / 12.0, 7919.0 * 0.02 * 0.012)
MODES = (1, 2, 3)


@pytest.mark.parametrize("springs", [(3e4, 2e3), (1e6, 1e3), (1e3, 1e4), (1e7, 1.0)])
def test_springs_come_back(springs: tuple[float, float]) -> None:
    """From three frequencies of the theory itself: to 1e-9, inside their intervals, and named identified."""
    fit = identify_end_springs(BEAM, MODES, tuple(BEAM.frequencies(np.array(MODES), *springs)))
    assert fit.springs == pytest.approx(springs, rel=1e-9)
    assert fit.misfit < 1e-12
    assert fit.reproduces
    for spring in (fit.draught, fit.torsion):
        assert spring.verdict == "identified"
        assert spring.low < spring.value < spring.high


def test_the_length_comes_back() -> None:
    """With the length among the unknowns, between 460 and 510 mm."""
    beam = SpringBeam(0.484, BEAM.bending, BEAM.mass)
    fit = identify_end_springs(BEAM, (1, 2, 3, 4), tuple(beam.frequencies(np.arange(1, 5), 2e5, 3e3)), (0.46, 0.51))
    assert fit.springs == pytest.approx((2e5, 3e3), rel=1e-7)
    assert fit.beam.length == pytest.approx(0.484, rel=1e-9)
    assert fit.length is not None
    assert 0.46 <= fit.length.low < 0.484 < fit.length.high <= 0.51


def test_on_plateaus_only_limits_are_reported() -> None:
    """A spring that no frequency feels is not identified: stiff ones have a lower limit, soft ones an upper one.

    At the limit the frequencies are off by what the accuracy allows, whatever the other spring does.
    """
    clamped = identify_end_springs(BEAM, MODES, tuple(BEAM.frequencies(np.array(MODES), np.inf, np.inf)))
    assert [clamped.draught.verdict, clamped.torsion.verdict] == ["at least", "at least"]
    pinned = identify_end_springs(BEAM, (2, 3, 4), tuple(BEAM.frequencies(np.arange(2, 5), np.inf, 0.0)))
    assert [pinned.draught.verdict, pinned.torsion.verdict] == ["at least", "at most"]
    assert np.isinf(clamped.torsion.high)
    assert pinned.torsion.low == 0.0
    off = np.log(BEAM.frequencies(np.arange(2, 5), np.inf, pinned.torsion.high) / pinned.given)
    assert np.linalg.norm(off) == pytest.approx(1.96 * 0.01, rel=0.1)


def test_the_interval_is_where_the_misfit_says_so() -> None:
    """With accurate frequencies the misfit of the whole problem at its ends, all else fitted anew, is 1.96 sigma."""
    modes = (1, 2, 3, 4)
    given = BEAM.frequencies(np.array(modes), 5e4, 1e3)
    fit = identify_end_springs(BEAM, modes, tuple(given), accuracy=1e-3)
    others = np.linspace(np.log(800.0), np.log(1250.0), 4001)
    for end in (fit.draught.low, fit.draught.high):
        off = np.log(BEAM.frequencies(np.array(modes)[:, None], end, np.exp(others)) / given[:, None])
        assert np.min(np.linalg.norm(off, axis=0)) == pytest.approx(1.96e-3, rel=0.03)


def test_two_frequencies_may_have_two_answers() -> None:
    """Both are reported, and both have these frequencies; a third frequency decides."""
    given = tuple(BEAM.frequencies(np.array([1, 2]), 3e4, 2e3))
    fit = identify_end_springs(BEAM, (1, 2), given)
    found = [fit.springs, *fit.others]
    assert len(found) == 2
    for springs in found:
        assert BEAM.frequencies(np.array([1, 2]), *springs) == pytest.approx(given, rel=1e-9)
    third = identify_end_springs(BEAM, MODES, (*given, float(BEAM.frequencies(3, 3e4, 2e3))))
    assert third.others == ()


def test_what_no_springs_reproduce_is_reported() -> None:
    """The frequencies of the clamped overhang are above those of any springs on the whole length."""
    whole = SpringBeam(0.51, BEAM.bending, BEAM.mass)
    fit = identify_end_springs(whole, MODES, tuple(BEAM.frequencies(np.array(MODES), np.inf, np.inf)))
    assert not fit.reproduces
    assert fit.deviation > 10.0 * fit.accuracy


@pytest.mark.parametrize(
    ("modes", "frequencies"), [((1,), (40.0,)), ((1, 1), (40.0, 50.0)), ((1, 2), (40.0, -1.0)), ((1, 2), (40.0,))]
)
def test_bad_frequencies_are_refused(modes: tuple[int, ...], frequencies: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"cannot determine|of its own|not positive"):
        identify_end_springs(BEAM, modes, frequencies)
