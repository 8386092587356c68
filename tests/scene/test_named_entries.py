"""Entries of files of several structures that others name: a slip in one is no slip of the others."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest

import gapbeam as gb
from tests.shared.slips import Tables, put

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
LAW = {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 10.0}
NAMED: Tables = {
    "structure": [
        {"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e3}},
        {"name": "rod", "model": {"type": "beam", "length": 0.4, "thickness": 0.012, "material": STEEL}},
    ],
    "point": [{"name": "tip", "structure": "rod", "at": 0.4}],
    "joint": [
        {"type": "clamped", "name": "root", "structure": "rod", "at": 0.0},
        {"type": "elastic", "name": "mat", "between": ["box.at"], "stiffness": 10.0},
        {
            "type": "snubber",
            "name": "strut",
            "between": ["rod.tip"],
            "velocity": 0.1,
            "release": 0.05,
            "stiffness": 1e5,
        },
    ],
    "pair": [{"name": "gap", "between": ["rod.tip"], "region": {"type": "slot", "clearance": 1e-3}, "law": LAW}],
    "load": [
        {"type": "harmonic_force", "point": "box.at", "amplitude": 5.0, "frequency": 30.0},
        *(
            {"type": "support_motion", "name": f"of-{name}", "support": name, "amplitude": 1e-4, "frequency": 5.0}
            for name in ("root", "mat", "strut", "gap")
        ),
        {"type": "clearance_change", "support": "gap", "times": [0.0, 0.1], "changes": [0.0, 1e-4]},
    ],
    "figure": [{"name": "knock", "quantity": "contact_force", "place": "gap"}],
    "time": {"step": 1e-4, "end": 0.2},
}


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (("structure", 0, "model", "mass"), -2.0),
        (("structure", 1, "model", "length"), "long"),
        (("point", 0, "at"), "end"),
        (("joint", 0, "at"), -1.0),
        (("joint", 1, "stiffness"), -10.0),
        (("joint", 2, "release"), "slow"),
        (("pair", 0, "friction"), -0.1),
        (("pair", 0, "law"), {"type": "kelvin-voigt", "stiffness": 0.0}),
        (("pair", 0, "region"), "slit"),
    ],
)
def test_a_fault_in_what_others_name_is_the_only_one(key: tuple[str | int, ...], value: Any) -> None:
    """What names an entry with a fault is right: loads of a pair with a slip were refused, too, as it was none."""
    given = copy.deepcopy(NAMED)
    gb.scene(given)
    put(*key, value=value)(given, Path())
    with pytest.raises(gb.CaseError) as raised:
        gb.scene(given)
    assert [one.key[:2] for one in raised.value.faults] == [key[:2]]
