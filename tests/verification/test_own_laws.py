"""Supports with contact laws of their own: a rigid bar on two different laws, against SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.contact.laws.mixed_law import LawGroup, mixed_law
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.models.body import body_key
from gapbeam.solver.system.operators import Array
from tests.verification.test_own_contact import (
    AREA,
    DAMPERS,
    GRAVITY,
    INERTIA,
    LENGTH,
    MASS,
    PLACES,
    SPRINGS,
    stops,
    tables,
)
from tests.verification.test_shooting import chain

END, DROP = 0.02, 1.0e-4
FULL_DEPTH, HERTZ, STRONGEST = 2.0e-5, 1.0e6, 8.0  # m, N/m^1.5, N s/m: the law at the right stop
ADAMS = {"type": "adams-impact", "damping": STRONGEST / AREA, "full_depth": FULL_DEPTH}


def two_laws(**more: Any) -> dict[str, Any]:
    """Return the bar above a spring with a damper on the left and ADAMS's law on the right, falling and turning."""
    support = stops(stiffness=[SPRINGS[0] / AREA, HERTZ / AREA])
    support[0] |= {"damping": DAMPERS[0] / AREA, "clearance": DROP}
    support[1] |= {"law": ADAMS, "clearance": DROP}
    motion = {"velocity": -0.05, "spin": 0.2}
    return tables(support, analysis={"type": "transient", "start": "undeformed", "motion": motion}) | more


def by_scipy(times: Array) -> Array:
    """Return the height of the tip over time: two DOFs, two laws, each clipped at zero."""
    arms = PLACES - 0.5 * LENGTH

    def change(_: float, state: Array) -> Array:
        height, angle, velocity, spin = state
        depth, rate = -(DROP + height + arms * angle), -(velocity + arms * spin)
        q = min(max(depth[1], 0.0) / FULL_DEPTH, 1.0)
        damping = np.array([DAMPERS[0], STRONGEST * q * q * (3.0 - 2.0 * q)])
        elastic = np.array([SPRINGS[0] * depth[0], HERTZ * max(depth[1], 0.0) ** 1.5])
        force = np.where(depth > 0.0, np.maximum(elastic + damping * rate, 0.0), 0.0)
        return np.array([velocity, spin, force.sum() / MASS - GRAVITY, (arms @ force) / INERTIA])

    start = [0.0, 0.0, -0.05, 0.2]
    found = solve_ivp(change, (0.0, float(times[-1])), start, "DOP853", times, rtol=1e-10, atol=1e-14, max_step=2.0e-5)
    return np.asarray(found.y[0] + 0.5 * LENGTH * found.y[1])


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("scheme", ["discrete-gradient", "generalized-alpha"])
def test_bar_between_two_laws(scheme: str, tmp_path: Path) -> None:
    """A spring with a damper and ADAMS's law under one bar: its tip as by DOP853 with tight tolerances."""
    case = two_laws(time={"end": END, "step": 2.5e-5, "scheme": scheme}, output={"fields_interval": END})
    done = gapbeam.run(case, ["output.errors=none"], output=tmp_path / "run")
    assert done.exit_status == 0, done.message
    history = gapbeam.open_results(tmp_path / "run").history
    tip = history["displacement"].sel(probe="tip", component="y")
    every = len(tip) // 20
    times = tip["time"].values[::every]
    expected = by_scipy(times)
    error = np.abs(tip.values[::every] - expected).max() / np.abs(expected).max()
    assert error < 1e-3
    assert float(history["contact_force"].max("time").min()) > 0.0
    assert done.summary["model"]["supports"][1]["law"]["type"] == "adams-impact"


def test_a_law_by_touch_speed_at_one_support(tmp_path: Path) -> None:
    """The bar falls on a stop under its middle, whose restitution is 0.7; the other stop, of another law, is far away.

    Source: v' = -e v0 by the exact equation of Hunt and Crossley's law.
    """
    support = stops(stiffness=[1.0e8 / AREA, 1.0e5 / AREA])
    support[0] |= {"from": 0.5 * (LENGTH - 1e-3), "to": 0.5 * (LENGTH + 1e-3), "clearance": DROP}
    support[0] |= {"law": {"type": "hunt-crossley", "restitution": 0.7, "exponent": 1.5}, "stiffness": 1.0e9 / AREA}
    support[1] |= {"clearance": 0.01}
    motion = {"velocity": -0.5}
    more: dict[str, Any] = {"load": [], "analysis": {"type": "transient", "start": "undeformed", "motion": motion}}
    case = tables(support, **more) | {"time": {"end": 2.0e-3, "step": 1.0e-5}, "output": {"fields_interval": 2.0e-3}}
    done = gapbeam.run(case, ["output.errors=none"], output=tmp_path / "run")
    assert done.exit_status == 0, done.message
    velocity = gapbeam.open_results(tmp_path / "run").history["velocity"].sel(probe="tip", component="y")
    assert float(velocity[-1]) == pytest.approx(0.7 * 0.5, rel=5e-3)


def reason_of(law: dict[str, Any] | str) -> str | None:
    """Return why the bar with this law at its right stop is not marched by the compiled loop."""
    case = two_laws()
    case["support"][1]["law"] = law
    return why_not_compiled(gapbeam.model(gapbeam.read_case(case)).plan)


def test_laws_side_by_side_are_compiled() -> None:
    """The loop is compiled for laws of different dampers, for stops that yield and for stops that stiffen."""
    assert reason_of(ADAMS) is None
    assert reason_of({"type": "hunt-crossley", "restitution": 0.7}) is None
    assert reason_of({"type": "elastic-plastic", "yield_pressure": 1.0e6}) is None
    assert reason_of({"type": "piecewise-linear", "depths": [1.0e-5], "factors": [3.0]}) is None


def test_a_law_at_every_support_is_that_of_contact(tmp_path: Path) -> None:
    """The same law named at all supports, or once in [contact]: equal to the last bit."""
    case, named = two_laws(), two_laws()
    for one in (*case["support"], *named["support"]):
        one.pop("law", None)
        one.pop("damping", None)
        one["stiffness"] = HERTZ / AREA
    case["contact"] = {"law": ADAMS, "stiffness": HERTZ / AREA}
    for one in named["support"]:
        one["law"] = ADAMS
    found = []
    for number, tables_of in enumerate((case, named)):
        keys = ["output.errors=none", "time.end=5e-3", "output.fields_interval=5e-3"]
        done = gapbeam.run(tables_of, keys, output=tmp_path / str(number))
        assert done.exit_status == 0, done.message
        found.append(gapbeam.open_results(tmp_path / str(number)).history["displacement"].values)
    np.testing.assert_array_equal(*found)


def test_the_period_map_of_laws_side_by_side() -> None:
    """Two laws at alternating points, of the same numbers: the compiled period map of the one law, and its slope."""
    law = kelvin_voigt(2000.0, 3.0)
    groups = [LawGroup(np.array(points), law) for points in ([0, 2], [1, 3])]
    one, side_by_side = chain(law), chain(mixed_law(groups))
    x = np.array([0.01, -0.02, 0.015, 0.3, -0.2, 0.1])
    for found, expected in zip(side_by_side.with_tangent(x), one.with_tangent(x), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(side_by_side.history(x)[1], one.history(x)[1], atol=1e-6)
    np.testing.assert_allclose(side_by_side.after(x), one.after(x), atol=1e-9)


def test_laws_are_cheap_to_change() -> None:
    """Cases that differ in their laws alone share their body."""
    case = two_laws()
    case["support"][1]["law"] = "kelvin-voigt"
    assert body_key(gapbeam.read_case(case)) == body_key(gapbeam.read_case(two_laws()))


BAD = {
    "a law of another exponent without its stiffness": (
        {"support.1.stiffness": None},
        "none, with the law adams-impact of the exponent 1.5",
    ),
    "a rigid support": (
        {"contact": {"formulation": "unilateral"}, "support.0.stiffness": None, "support.0.damping": None},
        "adams-impact, with the formulation unilateral",
    ),
    "a damping that the law does not take": ({"support.1.damping": 3.0}, "the law adams-impact brings its own damping"),
    "a damping beside a restitution": (
        {"support.0.law": {"type": "kelvin-voigt", "restitution": 0.5}},
        "one of the two: the damping is computed from the restitution",
    ),
    "an unknown law": ({"support.0.law": "rubber"}, "rubber"),
    "a law that remembers, in the search for a period": (
        {
            "support.1.law": {"type": "hunt-crossley", "restitution": 0.5, "exponent": 1.5},
            "analysis": {"type": "periodic"},
            "load": [{"type": "base_motion", "name": "shaker", "amplitude": 30.0, "frequency": 30.0}],
        },
        "hunt-crossley, whose damping follows from the speed at touch",
    ),
}


@pytest.mark.parametrize(("changes", "words"), BAD.values(), ids=BAD)
def test_bad_laws_of_supports(changes: dict[str, Any], words: str) -> None:
    """What contradicts the rest of a case is refused, in the words of the support."""
    case = two_laws()
    for path, value in changes.items():
        table: Any = case
        *way, key = path.split(".")
        for part in way:
            table = table[int(part) if part.isdigit() else part]
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    with pytest.raises(gapbeam.CaseError) as error:
        gapbeam.read_case(case)
    assert words in str(error.value)
