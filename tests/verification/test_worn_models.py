"""Wear that changes the profile, in every model: points that are all worn alike are a gap that has grown by as much."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.contact.formulations.circle_contact import CircleOperator
from gapbeam.solver.contact.formulations.contact_points import ResultantOperator
from gapbeam.solver.messages.errors import CaseError
from gapbeam.studies.life.case_rates import CaseRates, PointRates
from gapbeam.studies.life.worn_case import worn_case
from tests.regression.test_life_study import GENTLE
from tests.verification.test_rigid_sections import BEAM, CLEARANCE, RIGID, SHAKER, SURFACE, WEIGHT, tables_of

DEPTH, AREA, END = 3.0e-5, 1.0e-3, 0.05  # m, m^2, s


def bar(kind: dict[str, Any]) -> dict[str, Any]:
    """Return a round bar in two holes that a shaker moves."""
    time, output = {"end": END, "step": 2.0e-5}, {"errors": "none", "history_interval": 2.0e-4}
    return tables_of(kind, load=[WEIGHT, SHAKER], time=time, output=output)


def flat(model: dict[str, Any], **mesh: Any) -> dict[str, Any]:
    """Return a flat bar with play that a shaker moves."""
    return GENTLE | {"model": model, "mesh": GENTLE["mesh"] | mesh, "time": GENTLE["time"] | {"end": END}}


LINES = {"type": "reduced", "modes": 12, "points_across": 1}
QUICK = {
    "beam": bar(BEAM),
    "reduced slice": flat({"type": "reduced", "modes": 12}),
    "reduced, one line across": flat(LINES, dimension=3, cells_across_width=2),
}
SLOW = {
    "rigid": bar({"type": "rigid"}),
    "rigid sections": bar(RIGID),
    "reduced, sections that deform": bar(SURFACE),
    "full slice": flat({"type": "full"}),
}


def case_of(tables: dict[str, Any], growth: str) -> Case:
    area = {"area": AREA} if growth == "even" else {}
    return gapbeam.read_case(tables | {"wear": {"coefficient": 2e-14, "depth_limit": 1e-4, "growth": growth} | area})


def hold_to_even_growth(tables: dict[str, Any]) -> None:
    """Hold rates on points that are worn alike to those on gaps that are larger by as much; others differ."""
    even, points = CaseRates(case_of(tables, "even")), PointRates(case_of(tables, "local"))
    contact = points.unworn.system.contact
    grown = even(np.full(len(even.names), DEPTH), 0).values * AREA

    def volumes(depths: np.ndarray) -> np.ndarray:
        found = points(depths, 0).values * contact.weights
        return np.bincount(points.owners, found, minlength=len(even.names))

    assert volumes(np.full(contact.size, DEPTH)) == pytest.approx(grown, rel=1e-9, abs=0.0)
    assert grown.max() > 0.0
    assert even(np.zeros(len(even.names)), 0).values * AREA != pytest.approx(grown, rel=0.01, abs=0.0)
    first = contact.positions[:, 0] < np.median(contact.positions[:, 0])
    assert volumes(np.where(first, DEPTH, 0.0)) != pytest.approx(grown, rel=1e-3, abs=0.0)


@pytest.mark.parametrize("name", QUICK)
def test_points_that_are_worn_alike_are_a_larger_gap(name: str) -> None:
    """Work rates to 1e-9, in holes and slots; half of the points worn is something else."""
    hold_to_even_growth(QUICK[name])


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("name", SLOW)
def test_points_of_solids_that_are_worn_alike_are_a_larger_gap(name: str) -> None:
    """Among them rigid sections, whose contact is compared with a mesh that is worn like it."""
    hold_to_even_growth(SLOW[name])


def test_the_mesh_below_resultants_is_worn_with_them() -> None:
    """By the depths of the points that share it: a pattern over x is the same above and below."""
    contact = PointRates(case_of(QUICK["reduced, one line across"], "local")).unworn.system.contact
    assert isinstance(contact, ResultantOperator)
    depths = 1e-5 * (1.0 + contact.positions[:, 0] / 0.05)
    worn = contact.worn(depths)
    assert worn.initial_gap - contact.initial_gap == pytest.approx(depths, abs=1e-18)
    below = worn.distributed.initial_gap - contact.distributed.initial_gap
    assert below == pytest.approx(1e-5 * (1.0 + contact.distributed.positions[:, 0] / 0.05), abs=2e-6)
    assert contact.shares @ below == pytest.approx(depths, abs=1e-15)


def circled(clearance: float = CLEARANCE) -> dict[str, Any]:
    holes = [
        one | {"clearance": clearance, "region": {"type": "hole", "contact": "circle"}} for one in bar(BEAM)["support"]
    ]
    return bar(BEAM) | {"support": holes}


def test_circles_grow_evenly() -> None:
    """A hole that is met as a circle and worn is the hole with that clearance; by points it is refused."""
    worn = CaseRates(case_of(circled(), "even"))(np.full(2, DEPTH), 0)
    larger = CaseRates(case_of(circled(CLEARANCE + DEPTH), "even"))(np.zeros(2), 0)
    assert worn.values == pytest.approx(larger.values, rel=1e-9, abs=0.0)
    assert worn.values.max() > 0.0
    contact = gapbeam.model(worn_case(case_of(circled(), "even"), [DEPTH, 2.0 * DEPTH])).model.system.contact
    assert isinstance(contact, CircleOperator)
    first = contact.positions[contact.circles.points, 0] < 0.5
    assert contact.circles.clearances == pytest.approx(CLEARANCE + np.where(first, DEPTH, 2.0 * DEPTH))
    with pytest.raises(CaseError, match="a circle has no points around it"):
        case_of(circled(), "local")
