"""Which motions a beam model has, and why: no more than its case calls for."""

from __future__ import annotations

from typing import Any

import pytest

import gapbeam
from gapbeam.solver.assembly.assembled_system import model_motions
from gapbeam.solver.case.beam_motions import beam_motions, motions_in_words
from gapbeam.solver.case.case import Case

UP = {"type": "harmonic_force", "name": "shaker", "point": 0.4, "amplitude": 1.0, "frequency": 20.0}
HOLE = [{"name": "bush", "from": 0.0, "to": 0.05, "clearance": 1.0e-4, "region": "hole"}]
ROUND = {"length": 0.4, "thickness": 0.02, "width": 0.02, "section": "round"}
RUBBING = {"friction": {"coefficient": 0.2}}


def case_of(dimension: int = 3, **more: Any) -> Case:
    """Return the case of a bar between base and gland."""
    tables = {
        "beam": {"length": 0.4, "thickness": 0.012, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
        "support": {"length": 0.05, "clearance": 1.0e-4},
        "mesh": {"dimension": dimension},
        "model": {"type": "beam"},
        "load": [UP],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    return gapbeam.read_case(tables | more)


def spring(name: str) -> dict[str, Any]:
    """Return an elastic joint with one spring."""
    return {"name": "end", "type": "elastic", "point": 0.4, "stiffness": {name: 10.0}}


MASS = {"name": "head", "point": 0.4, "mass": 0.1}
# dimension, other tables, motions beside bending, and what calls for the last of them
SCENES: dict[str, tuple[int, dict[str, Any], str, str]] = {
    "plane": (2, {}, "", ""),
    "space": (3, {}, "", ""),
    "clamped": (3, {"joint": [{"name": "root", "type": "clamped", "point": 0.4}]}, "", ""),
    "mass": (3, {"mass": [MASS]}, "", ""),
    "hole": (3, {"beam": ROUND, "support": HOLE}, "lateral", "a hole, a load or the start"),
    "sideways": (3, {"load": [UP | {"direction": [0.0, 1.0, 0.0]}]}, "lateral", "a hole, a load or the start"),
    "along": (2, {"load": [UP | {"direction": [1.0, 1.0]}]}, "axial", "the load shaker acts along the beam"),
    "shaken along": (2, {"load": [{"type": "base_motion", "amplitude": 9.0, "frequency": 9.0, "direction": [1, 0]}]},
                     "axial", "acts along the beam"),
    "along, beside the plane": (3, {"load": [UP | {"direction": [1.0, 0.0, 0.0], "point": [0.4, 0.01, 0.0]}]},
                                "lateral axial", "the load shaker acts along the beam"),
    "beside": (3, {"load": [UP | {"point": [0.4, 0.01, 0.0]}]}, "torsion", "passes beside the axis"),
    "sideways above": (3, {"load": [UP | {"point": [0.4, 0.0, 0.006], "direction": [0.0, 1.0, 0.0]}]},
                       "lateral torsion", "passes beside the axis"),
    "through the axis": (3, {"load": [UP | {"point": [0.4, 0.0, 0.006]}]}, "", ""),
    "axial spring": (3, {"joint": [spring("axial")]}, "axial", "end has a spring"),
    "lateral spring": (3, {"joint": [spring("lateral")]}, "lateral", "damper or inertia against motion across"),
    "lateral rotation": (3, {"joint": [spring("lateral_rotation")]}, "lateral", "end has a spring"),
    "twist spring": (3, {"joint": [spring("twist")]}, "torsion", "end has a spring, damper or inertia against twist"),
    "polar inertia": (3, {"mass": [MASS | {"polar_inertia": 1e-4}]}, "torsion", "head has a spring"),
    "mass ahead": (3, {"mass": [MASS | {"offset": [0.1, 0.0, 0.0]}]}, "", ""),
    "mass above a slice": (2, {"mass": [MASS | {"offset": [0.0, 0.1]}]}, "axial", "head is above or below the axis"),
    "mass above": (3, {"mass": [MASS | {"offset": [0.0, 0.0, 0.1]}]}, "axial", "head is above or below the axis"),
    "mass above, in a hole": (3, {"mass": [MASS | {"offset": [0.0, 0.0, 0.1]}], "beam": ROUND, "support": HOLE},
                              "lateral axial torsion", "head is above or below the axis"),
    "mass above, and a force beside": (3, {"mass": [MASS | {"offset": [0.0, 0.0, 0.1]}],
                                           "load": [UP | {"point": [0.4, 0.01, 0.0]}]},
                                       "lateral axial torsion", "passes beside the axis"),
    "mass beside": (3, {"mass": [MASS | {"offset": [0.0, 0.1, 0.0]}]}, "lateral axial torsion",
                    "head is beside the bending plane"),
    "friction in the plane": (2, {"contact": RUBBING}, "axial", "friction acts along the beam"),
    "friction": (3, {"contact": RUBBING}, "axial", "friction acts along the beam"),
    "friction in a hole": (3, {"contact": RUBBING, "beam": ROUND, "support": HOLE}, "lateral axial torsion",
                           "friction acts around the section"),
    "friction beside": (3, {"contact": RUBBING, "load": [UP | {"point": [0.4, 0.01, 0.0]}]}, "lateral axial torsion",
                        "passes beside the axis"),
    "no friction": (3, {"contact": {"friction": {"coefficient": 0.0}}}, "", ""),
    "given": (3, {"model": {"type": "beam", "motions": ["torsion", "bending"]}}, "torsion", "given in the case"),
}  # fmt: skip


@pytest.mark.parametrize("scene", SCENES)
def test_a_beam_has_the_motions_that_its_case_calls_for(scene: str) -> None:
    """And no others: the motions in their order, and the reason of the last one."""
    dimension, tables, wanted, why = SCENES[scene]
    case = case_of(dimension, **tables)
    found = beam_motions(case)
    assert list(found) == ["bending", *wanted.split()]
    assert why in list(found.values())[-1]
    assert len(motions_in_words(case)) == len(wanted.split())


def test_sections_move_as_the_beam_does() -> None:
    """Of a slice that stays in its plane two motions, of a tube that rubs in its hole all six."""
    assert model_motions(case_of(2)) == ("vertical", "rotation")
    rubbing = case_of(3, beam=ROUND, support=HOLE, contact=RUBBING)
    assert model_motions(rubbing) == ("axial", "vertical", "rotation", "lateral", "lateral_rotation", "twist")
