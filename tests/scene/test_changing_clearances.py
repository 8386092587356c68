"""Clearances of pairs that change over time, against springs in closed form and a SciPy integration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

import gapbeam as gb
from tests.scene.test_face_contacts import sled
from tests.shared.slips import Change, check_slip, put

SPRING, STOP, GAP, PRESSED = 4e4, 1e6, 2e-4, 3e-4
"""N/m, N/m, and m that the clearance is at the start and that it is pressed by at the end."""
CLOSURE = {"type": "clearance_change", "name": "closure", "support": "gap", "times": [0.0, 0.05, 0.1],
           "changes": [0.0, -1e-4, -GAP - PRESSED]}  # fmt: skip
LAW = {"type": "kelvin-voigt", "stiffness": STOP, "damping": 200.0}


def closing(region: dict[str, Any], motions: int = 1, **closure: Any) -> dict[str, Any]:
    """Return the tables of a damped mass on a spring, in a region that closes until it presses."""
    model = {"type": "mass", "mass": 2.0, "stiffness": SPRING, "damping": 300.0, "motions": motions}
    return {
        "structure": [{"name": "box", "model": model}],
        "pair": [{"name": "gap", "between": ["box.at"], "region": region, "law": LAW}],
        "load": [CLOSURE | closure],
        "time": {"step": 2e-4, "end": 0.5},
    }


ONE = {"type": "half-plane", "clearance": GAP}
ALONG = np.array([0.6, 0.8])
SQUARE = {"type": "polygon", "corners": [[-GAP, -GAP], [GAP, -GAP], [GAP, GAP], [-GAP, GAP]]}
SINKS = PRESSED * STOP / (STOP + SPRING)  # of the mass, where one face presses it against its spring
ENDS = [
    ("a stop", ONE, [-SINKS], {"gap": [SPRING * SINKS]}),
    ("a stop below", ONE | {"normal": -1}, [SINKS], {"gap": [-SPRING * SINKS]}),
    ("an oblique stop", ONE | {"normal": ALONG.tolist()}, -SINKS * ALONG, {"gap": SPRING * SINKS * ALONG}),
    ("a slot", {"type": "slot", "clearance": GAP}, [0.0], {"gap-0": [0.5 * STOP * PRESSED]}),
    ("a square", SQUARE, [0.0, 0.0], {"gap-1": [STOP * PRESSED, 0.0], "gap-0": [0.0, -STOP * PRESSED]}),
]


@pytest.mark.parametrize(("region", "place", "forces"), [one[1:] for one in ENDS], ids=[one[0] for one in ENDS])
def test_a_region_that_closes_presses_as_springs_in_a_row(region: Any, place: Any, forces: Any, tmp_path: Path) -> None:
    """A stop sinks a mass into its spring; faces on both sides press without moving it. The walls do the work."""
    tables = closing(region, len(place))
    outcome = gb.run(gb.scene(tables), step=2e-4, end=0.5, output=tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    found = gb.history(gb.scene(tables), 2e-4, 0.5)
    assert found.displacement["at"][-1] == pytest.approx(place if len(place) > 1 else place[0], abs=1e-9)
    for name, force in forces.items():
        assert found.force[name][-1] == pytest.approx(-np.array(force if len(force) > 1 else force[0]), rel=1e-5)
    energy = found.last.energy
    assert energy["walls"] > 0.0
    assert energy["walls"] == pytest.approx(
        energy["strain"] + energy["contact"] + energy["law"] + energy["damping"], rel=1e-6
    )


def moved(t: Any) -> Any:
    """Return the change of the clearance and its rate."""
    times, changes = np.array(CLOSURE["times"]), np.array(CLOSURE["changes"])
    slopes = PchipInterpolator(times, changes).derivative()(times)
    slopes[[0, -1]] = 0.0
    curve = CubicHermiteSpline(times, changes, slopes)
    return curve(min(t, times[-1])), curve(t, 1) if t < times[-1] else 0.0


def test_a_stop_that_closes_moves_a_mass_as_an_integration_has_it() -> None:
    """The mass is met and driven back, with the damper of the law; the midpoint rule is of order 2."""

    def rates(t: float, y: Any) -> Any:
        x, speed = moved(t)
        deep, pace = y[0] - GAP - x, y[1] - speed
        force = max(STOP * deep + 200.0 * pace, 0.0) if deep > 0.0 else 0.0
        return [y[1], (-SPRING * y[0] - 300.0 * y[1] - force) / 2.0]

    exact = solve_ivp(rates, (0.0, 0.16), [0.0, 0.0], "DOP853", rtol=1e-10, atol=1e-14, max_step=1e-4).y[0, -1]
    far = []
    for h in (8e-4, 4e-4, 2e-4, 1e-4):
        found = gb.history(gb.scene(closing(ONE)), h, 0.16)
        far.append(abs(found.displacement["at"][-1] - exact))
    assert far[-1] < 1e-4 * abs(exact)
    assert np.polyfit(np.log([8.0, 4.0, 2.0, 1.0]), np.log(far), 1)[0] > 1.5


def test_a_pair_of_structures_and_a_pair_of_faces_close(tmp_path: Path) -> None:
    """Two masses on springs are pressed apart as three springs in a row; faces lift a block by what they close."""
    tables = closing(ONE)
    tables["structure"].append({"name": "other", "model": {"type": "mass", "mass": 1.0, "stiffness": 2.0 * SPRING,
                                                           "damping": 300.0}})  # fmt: skip
    tables["pair"][0]["between"] = ["box.at", "other.at"]
    found = gb.history(gb.scene(tables), 2e-4, 0.6)
    force = PRESSED / (1.0 / STOP + 1.0 / SPRING + 0.5 / SPRING)
    assert found.displacement["box.at"][-1] == pytest.approx(-force / SPRING, rel=1e-6)
    assert found.displacement["other.at"][-1] == pytest.approx(0.5 * force / SPRING, rel=1e-6)
    given = sled(tmp_path)
    given["load"] = [CLOSURE | {"support": "under", "times": [0.0, 0.01], "changes": [0.0, -1e-6]}, given["load"][0]]
    given["contact"] = {"law": {"type": "kelvin-voigt", "stiffness": 1e13, "damping": 1e9}}
    scene = gb.scene(given)
    lifted = gb.history(scene, 1e-5, 0.02)
    still = gb.history(gb.scene(given | {"load": given["load"][1:]}), 1e-5, 0.02)
    assert len(scene.contacts) > 4
    block = scene.structures[0]
    assert block.geometry is not None
    risen = (lifted.last.state.q - still.last.state.q)[: block.size, 0]
    u = block.geometry.displacements(risen if scene.is_large else block.modes[2] @ risen)
    assert u.mean(axis=0) == pytest.approx([0.0, 1e-6, 0.0], abs=1e-11)


SLIPS: dict[str, tuple[Change, str, str]] = {
    "an unknown pair": (put("load", 0, "support", value="gab"), "closure.*support", "one of gap"),
    "a disc": (put("pair", 0, "region", value={"type": "disc", "clearance": GAP}), "closure.*support", "30 corners"),
    "times that fall": (put("load", 0, "times", value=[0.0, 0.1, 0.05]), "closure.*times", "ascending"),
    "a jump at the start": (put("load", 0, "changes", value=[1e-4, 0.0, 0.0]), "closure.*changes", "0.0"),
    "a change too many": (put("load", 0, "changes", value=[0.0, 0.0]), "closure.*changes", "one change for each"),
    "a direction": (put("load", 0, "direction", value=[1.0]), "closure.*direction", "unknown"),
    "no pair": (put("load", 0, "support", value=None), "closure.*support", "missing"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_of_clearances_that_change_are_refused(slip: str, tmp_path: Path) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = closing(ONE, 2 if slip == "a disc" else 1)
    check_slip(given, SLIPS[slip], tmp_path)
