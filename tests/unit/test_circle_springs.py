"""Springs around sections that are met as circles: those at all points, from two motions of each section."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.sparse import csr_matrix

import gapbeam
from gapbeam.solver.contact.formulations import circle_contact
from gapbeam.solver.contact.formulations.circle_contact import CircleOperator
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import Array

CIRCLE = {"type": "hole", "contact": "circle"}
BUSH = {"type": "hole", "contact": "points"}


def contact_in(regions: list[dict[str, Any]], model: Any) -> CircleOperator:
    """The contact of a tube in supports of some regions, every 0.4 m."""
    supports = [
        {"name": f"s{n}", "from": 0.4 * n + 0.39, "to": 0.4 * n + 0.41, "clearance": 1.0e-4, "region": region}
        for n, region in enumerate(regions)
    ]
    case = {
        "beam": {
            "length": 0.4 * (len(regions) + 1),
            "thickness": 0.019,
            "width": 0.019,
            "section": {"type": "tube", "wall": 0.0011},
        },
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
        "joint": [{"name": "end", "type": "clamped", "point": 0.0}],
        "support": supports,
        "model": model,
        "mesh": {"dimension": 3},
        "contact": {"stiffness": 2.0e11},
        "load": [{"type": "gravity", "direction": [0.0, 0.0, -1.0]}],
        "time": {"end": 1.0, "step": 2.0e-5},
    }
    contact = build_model(gapbeam.read_case(case), MPI.COMM_SELF).system.contact
    assert isinstance(contact, CircleOperator)
    return contact


@pytest.mark.parametrize(
    ("regions", "elements"), [([CIRCLE], 120), ([BUSH, CIRCLE, CIRCLE], 8)], ids=["one, of a basis", "beside points"]
)
def test_those_at_all_points(regions: list[dict[str, Any]], elements: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for round-off, from two rows for each station."""
    contact = contact_in(regions, {"type": "beam", "elements": elements})
    stiffness = np.random.default_rng(0).uniform(1.0e10, 3.0e11, contact.size)
    everywhere = np.empty(contact.around.size)
    everywhere[contact.kept] = stiffness[contact.others]
    for point, members in zip(contact.circles.points, contact.circles.members, strict=True):
        everywhere[members] = stiffness[point]
    cases = [(given, contact.around.springs(whole)) for given, whole in ((2.0e11, 2.0e11), (stiffness, everywhere))]
    rows = list[int]()

    def counted(matrix: csr_matrix, springs: Array) -> csr_matrix:
        rows.append(matrix.shape[0])
        return csr_matrix(matrix.T @ matrix.multiply(springs[:, None]))

    monkeypatch.setattr(circle_contact, "spring_matrix", counted)
    for given, expected in cases:
        found = contact.springs(given).matrix.toarray()
        assert found == pytest.approx(expected.matrix.toarray(), abs=1e-12 * abs(expected.matrix).max())
    assert rows == [2 * len(contact.circles.points) + len(contact.kept)] * 2
    assert rows[0] < contact.around.size
