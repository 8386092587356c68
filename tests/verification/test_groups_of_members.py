"""Libraries whose members share damping in groups, and members held out that are unlike the others."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import gapbeam as gb
from gapbeam.studies.library.calibrated_regression import regression
from tests.verification.test_recording_library import FORCE, PERIOD, marched, recordings

RANGES = {"stop.clearance": (0.3, 2.0), "stop.stiffness": (5.0, 80.0), "body.damping_factor": (0.4, 4.0)}


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize(("members", "seed"), [(256, 0), (512, 0), (512, 1), (512, 2)])
def test_intervals_hold_where_members_share_their_damping(members: int, seed: int) -> None:
    """60 recordings of a Runge-Kutta march: intervals hold as often as a binomial of 95 % allows (1 in 1000).

    With 64 members to a damping factor, of 8 groups one was held out: half to nine tenths of the intervals held.
    """
    body = gb.mass(1.0, stiffness=1.0, damping=0.1, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1.0), gb.KelvinVoigt(stiffness=20.0, damping=0.2), name="stop")
    shaker = gb.Force(body["at"], lambda t: FORCE * np.cos(0.8 * t), name="shaker")
    found = gb.library(
        gb.Scene(body, contacts=[stop], loads=[shaker]), {path: stats.loguniform(*one) for path, one in RANGES.items()},
        point="at", quantity="velocity", period=PERIOD, members=members, periods=40, harmonics=8, settle=20, steps=256,
        seed=seed,
    )  # fmt: skip
    ends = np.log(np.array(list(RANGES.values())))
    true = np.exp(np.random.default_rng(3).uniform(ends[:, 0], ends[:, 1], (60, 3)))
    y = marched(np.column_stack([true[:, :2], np.full(60, 0.2)]), 1, damping=0.1 * true[:, 2])
    table = [[(x.low, x.high) for x in gb.estimate(found, one).values.values()] for one in recordings(y)]
    inside = ((np.array(table)[..., 0] <= true) & (true <= np.array(table)[..., 1])).sum(axis=0)
    assert np.all(inside >= stats.binom(60, 0.95).ppf(1e-3))


@pytest.mark.parametrize("side", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_one_member_without_contact_spoils_no_estimate(seed: int, side: float) -> None:
    """Members at an end of a range have features without information: one of them held out moved all estimates."""
    draw = np.random.default_rng(seed)
    A = draw.standard_normal((3, 9))

    def drawn(count: int, blind: int) -> tuple[np.ndarray, np.ndarray]:
        u = 0.04 + 0.92 * draw.random((count, 3))
        u[:blind, 0] = side
        z = u @ A + 0.02 * draw.standard_normal((count, 9))
        z[:blind] = 8.0 * A.sum(axis=0) + 0.02 * draw.standard_normal((blind, 9))
        return z, u

    members, (z, u), (seen, true) = drawn(512, 6), drawn(64, 0), drawn(400, 0)
    odd, place = drawn(1, 1)
    errors = [
        np.median(np.abs(regression(*members, held, values)(seen)[0] - true), axis=0)
        for held, values in ((z, u), (np.vstack([z, odd]), np.vstack([u, place])))
    ]
    assert np.all(errors[1] < 1.2 * errors[0])
