"""Waves along a beam and bending waves, each with its own wavelength: of bars, sqrt(E / density) / f."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.model_choice import bending_wavelength
from gapbeam.solver.diagnostics.assumption import FrequencyContent, content_of_motion
from gapbeam.solver.run.assumptions.frequency_findings import ON_MESH, RIGID, shortest_wave

LENGTH, THICKNESS = 0.5, 0.01  # m
TIMES = np.asarray(1.0e-5 * np.arange(4000), dtype=np.float64)
GUIDE = {"name": "guide", "from": 0.2, "to": 0.3, "clearance": 1.0e-3, "region": "slot"}


def bar(modulus: float = 2.0e11, density: float = 8000.0, **tables: Any) -> gapbeam.Case:
    """Return a bar on a spring along it, in a slot that it does not touch, thrown along itself."""
    spring = {"axial": 1.0e8, "vertical": 1.0e3, "rotation": 1.0e3}
    return gapbeam.read_case(
        {
            "beam": {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS},
            "material": {"young_modulus": modulus, "poisson_ratio": 0.3, "density": density},
            "support": [GUIDE],
            "model": {"type": "beam", "elements": 30},
            "mesh": {"dimension": 2},
            "joint": [{"name": "wall", "type": "elastic", "point": LENGTH, "stiffness": spring}],
            "analysis": {"type": "transient", "start": "undeformed", "motion": {"velocity": [1.0, 0.0]}},
            "probe": [{"name": "tip", "point": 0.0}, {"name": "root", "point": LENGTH}],
            "time": {"end": 4.0e-4, "step": 5.0e-7},
            "output": {"history_interval": 5.0e-7, "errors": "none"},
            **tables,
        }
    )


def recorded(along: tuple[float, float], across: tuple[float, float]) -> FrequencyContent:
    """Return the content of two harmonic velocities, each of an amplitude, m/s, and a frequency, Hz."""
    velocity = np.stack([size * np.sin(2.0 * pi * f * TIMES) for size, f in (along, across)], axis=1)
    found = content_of_motion(TIMES, velocity[:, None, :])
    assert found is not None
    return found


@settings(max_examples=30, deadline=None)
@given(
    st.floats(1.0e9, 4.0e11), st.floats(500.0, 2.0e4), st.floats(500.0, 2.0e4), st.floats(500.0, 2.0e4),
    st.sampled_from([0.0, 0.01, 0.3, 1.0]),
)  # fmt: skip
def test_each_kind_of_wave_has_its_own_length(
    modulus: float, density: float, lengthwise: float, bending: float, bends: float
) -> None:
    """The shorter one of those that carry energy; bending by Bernoulli's thin beam, where waves are long."""
    case = bar(modulus, density)
    wave = shortest_wave(case, recorded((1.0, lengthwise), (bends, bending)))
    speed = sqrt(modulus / density)
    gyration = THICKNESS / sqrt(12.0)
    lengths = [speed / lengthwise]
    if bends >= 0.1:  # its square is the share of the energy
        lengths.append(sqrt(2.0 * pi * gyration * speed / bending))
    # Timoshenko's waves are shorter than those of a thin beam by shear and rotatory inertia
    assert wave.length <= 1.05 * min(lengths)
    if bends < 0.1:
        assert wave.length == pytest.approx(lengths[0], rel=0.1)
        assert "along the beam" in wave.words


@pytest.mark.parametrize(("model", "warned"), [({"type": "beam", "elements": 30}, None), ({"type": "rigid"}, RIGID)])
def test_a_bar_that_is_thrown_along_itself(model: dict[str, Any], warned: Any, tmp_path: Path) -> None:
    """Bending waves of 11 kHz would be too short for 30 elements, and none is there; a rigid bar is one."""
    case = bar(model=model)
    summary = gapbeam.run(case, output=tmp_path).summary
    found = {one["name"]: one for one in summary["assumptions"]}
    wanted = [] if warned is None else [warned.name]
    assert [name for name, one in found.items() if one["verdict"] != "holds"] == wanted
    if warned is None:
        on_mesh = found[ON_MESH.name]
        assert "along the beam" in on_mesh["detail"]
        frequency = 5000.0 / (LENGTH / 30.0 / on_mesh["closest"])
        assert ON_MESH.limit * bending_wavelength(case.profile.pieces[0], frequency) < LENGTH / 30.0
