"""Random forces along the beam: joint acceptances and mean squares against their closed forms."""

from __future__ import annotations

import json
from itertools import product
from math import exp, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.loads.coherence_table import (
    ExponentialCoherence,
    FullCoherence,
    GaussianCoherence,
    double_integrals,
)
from gapbeam.solver.loads.random_line_load import RandomLineLoad, line_patterns
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from tests.verification.test_joints_and_masses import AREA, DENSITY, ROOT, TIP, joint, tables
from tests.verification.test_joints_and_masses import LENGTH as BEAM

LENGTH = 1.3


def sines(x: Array) -> Array:
    """Return sin(m pi x / L), m = 1 to 4, (places, 4)."""
    return np.asarray(np.sin(np.pi * np.outer(x / LENGTH, np.arange(1, 5))))


def exact(m: int, n: int, length: float, beam: float = LENGTH) -> float:
    """Return J^2_mn of sines under exp(-d / length) by hand, with a = L / length.

    int_0^1 int_0^1 sin(m pi x) sin(n pi y) exp(-a |x - y|) dx dy, from the solution of g'' - a^2 g = -2 a sin(n pi x),
    which the inner integral satisfies.
    """
    a, k, q = beam / length, m * pi, n * pi
    first = a / (a * a + q * q) if m == n else 0.0
    even = (1.0 + (-1.0) ** (m + n)) - exp(-a) * ((-1.0) ** m + (-1.0) ** n)
    return first + q * k * even / ((a * a + q * q) * (a * a + k * k))


@pytest.mark.parametrize("length", [0.05, 0.3, 2.0])
def test_joint_acceptances_of_sines(length: float) -> None:
    """The integrals are those by hand to 1e-12, for all pairs of four modes."""
    found = double_integrals(sines, ExponentialCoherence(type="exponential", length=length), LENGTH) / LENGTH**2
    wanted = [[exact(m, n, length) for n in range(1, 5)] for m in range(1, 5)]
    assert found == pytest.approx(np.array(wanted), abs=1e-12)


@pytest.mark.parametrize("length", [0.05, 0.3, 2.0])
def test_patterns_load_modes_as_the_load_does(length: float) -> None:
    """The mean square of the force of all patterns on each mode, and between modes, is L^2 J^2 to 1e-6 of its size."""
    patterns = line_patterns(ExponentialCoherence(type="exponential", length=length), (0.2, 0.2 + LENGTH), 20, None)
    forces = np.array([pattern.weights for pattern in patterns]) @ sines(np.array(patterns[0].places) - 0.2)
    wanted = [[LENGTH**2 * exact(m, n, length) for n in range(1, 5)] for m in range(1, 5)]
    assert forces.T @ forces == pytest.approx(np.array(wanted), abs=1e-6 * wanted[3][3])


def test_a_load_that_is_alike_everywhere_is_one_pattern() -> None:
    """Full coherence is one pattern: on the first sine it exerts 2 L / pi, and v^2 times that in a flow v."""
    (pattern,) = line_patterns(FullCoherence(type="full"), (0.0, LENGTH), 20, None)
    assert np.array(pattern.weights) @ sines(np.array(pattern.places))[:, 0] == pytest.approx(2.0 * LENGTH / pi)
    (faster,) = line_patterns(FullCoherence(type="full"), (0.0, LENGTH), 20, ((0.0, LENGTH), (2.0, 2.0)))
    assert faster.weights == pytest.approx(tuple(4.0 * weight for weight in pattern.weights))


def test_a_flow_over_half_the_length() -> None:
    """A profile that is 0 up to L / 2, and v beyond, loads a rigid motion by v^4 (L/2)^2 J^2_00 of half the length."""
    half, a = 0.5 * LENGTH, 0.5 * LENGTH / 0.3
    # int int exp(-a |x - y|) over the unit square
    alike = 2.0 * (a - 1.0 + exp(-a)) / a**2
    places = (0.0, half - 1e-9, half, LENGTH)
    patterns = line_patterns(
        ExponentialCoherence(type="exponential", length=0.3), (0.0, LENGTH), 16, (places, (0.0, 0.0, 1.5, 1.5))
    )
    assert sum(sum(one.weights) ** 2 for one in patterns) == pytest.approx(1.5**4 * half**2 * alike, rel=1e-6)


def test_a_smooth_coherence_over_a_short_distance_loads_like_white_noise() -> None:
    """Coherences of one integral load long waves alike: 2 length int s^2, to the share of the length in half a wave."""
    smooth = double_integrals(sines, GaussianCoherence(type="gaussian", length=0.01), LENGTH) / LENGTH**2
    assert smooth[0, 0] == pytest.approx(2.0 * 0.01 / LENGTH * 0.5, rel=0.01)


FLOW: dict[str, Any] = {
    "type": "random-line-load",
    "name": "flow",
    "span": [0.0, BEAM],
    "spectrum": {"type": "white", "density": 0.02, "low": 5.0, "high": 400.0},
    "coherence": {"type": "exponential", "length": 0.1},
}
ENDS = [joint(ROOT, "pinned"), joint(TIP, "pinned")]


def flow_on(kind: str) -> Model:
    """Return the model of a beam on two pins in the flow."""
    case = gapbeam.read_case(tables(joint=ENDS, load=[FLOW], model={"type": kind}))
    return build_model(case, MPI.COMM_SELF)


@pytest.mark.parametrize("kind", ["beam", "reduced"])
def test_modes_of_a_beam_are_loaded_by_their_joint_acceptance(kind: str) -> None:
    """Covariances of modal forces of a beam on two pins are 2 / (rho A L) L^2 J^2_mn, as its modes are sines."""
    model = flow_on(kind)
    names = [load.name for load in model.system.loads]
    assert names == [f"flow {number}" for number in range(1, len(names) + 1)]
    assert 8 < len(names) <= 16
    assert isinstance(model.system.operators, DenseOperators)
    squares, shapes = model.system.operators.modes
    patterns = np.array([load.pattern for load in model.system.loads])
    forces = patterns @ shapes[:, squares > (2.0 * pi * 10.0) ** 2][:, :3]
    wanted = [[2.0 * BEAM / (DENSITY * AREA) * exact(m, n, 0.1, BEAM) for n in (1, 2, 3)] for m in (1, 2, 3)]
    assert np.abs(forces.T @ forces) == pytest.approx(np.abs(wanted), abs=2e-3 * wanted[0][0])


def test_a_mesh_is_loaded_as_beam_elements_are() -> None:
    """Each pattern does the work on a sine along the mesh that its forces do by hand, to the order of the cells."""
    model = flow_on("full")
    x = model.space.tabulate_dof_coordinates()[: model.space.dofmap.index_map.size_local, 0]
    motion = np.column_stack([np.zeros(len(x)), np.sin(pi * x / BEAM)]).ravel()
    load = model.case.load[0]
    assert isinstance(load, RandomLineLoad)
    for made, pattern in zip(model.system.loads, load.patterns, strict=True):
        by_hand = float(np.array(pattern.weights) @ np.sin(pi * np.array(pattern.places) / BEAM))
        assert made.pattern @ motion == pytest.approx(by_hand, abs=1e-6 * BEAM)


def test_a_rigid_body_takes_the_whole_force() -> None:
    """The mean square of the force on a body that does not bend is the load's, L^2 J^2_00."""
    patterns = line_patterns(ExponentialCoherence(type="exponential", length=0.1), (0.0, BEAM), 16, None)
    a = BEAM / 0.1
    assert sum(sum(one.weights) ** 2 for one in patterns) == pytest.approx(
        BEAM**2 * 2.0 * (a - 1.0 + exp(-a)) / a**2, rel=1e-8
    )


def test_what_a_model_depends_on() -> None:
    """Sweeps over seeds and densities share a model; another span, coherence or profile is another model."""

    def key(**more: Any) -> object:
        return body_key(gapbeam.read_case(tables(joint=ENDS, load=[FLOW | more])))

    assert key() == key(seed=3, ramp=0.1) == key(spectrum={"type": "white", "density": 2.0, "high": 100.0})
    profile = {"places": [0.0, BEAM], "values": [1.0, 2.0]}
    for more in (
        {"coherence": {"type": "exponential", "length": 0.2}},
        {"stations": 8},
        {"span": [0.1, BEAM]},
        {"velocity_profile": profile},
    ):
        assert key() != key(**more)


def test_a_run_estimates_its_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Companions take the load of the case along: their models are made from cases with neutral keys."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    case = tables(
        joint=ENDS,
        load=[FLOW],
        model={"type": "beam", "elements": 20},
        probe=[{"name": "tip", "point": 0.5 * BEAM}],
        time={"end": 0.01, "step": 2.0e-4},
    )
    outcome = gapbeam.run(gapbeam.read_case(case), {}, tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    assert any("+-" in row["interval"] for row in outcome.summary["closing"]["rows"])


@pytest.mark.slow(minutes=0.3)
def test_the_rms_of_a_beam_without_contact_is_that_of_its_modes(tmp_path: Path) -> None:
    """The interval of the rms at the middle holds the sum over modes, by quadrature over frequency.

    S_w(f) = S(f) sum_mn phi_m phi_n H_m(f) H_n(f)* L^2 J^2_mn, with three modes in the band.
    """
    out = gapbeam.run(
        gapbeam.read_case(
            tables(
                joint=ENDS,
                load=[FLOW],
                model={"type": "beam", "elements": 20},
                damping={"ratio": 0.03},
                probe=[{"name": "tip", "point": 0.5 * BEAM}],
                time={"end": 40.0, "step": 2.0e-4},
                output={"errors": "none", "fields_interval": 10.0},
            )
        ),
        {},
        tmp_path / "run",
    )
    assert out.exit_status == 0, out.message
    figures = json.loads((tmp_path / "run" / "summary.json").read_text())["statistics"]["figures"]
    found = next(one for one in figures if one["name"] == "probe.tip.rms")
    f = np.linspace(5.0, 400.0, 400_001)
    total = np.zeros_like(f)
    model = flow_on("beam")
    assert isinstance(model.system.operators, DenseOperators)
    squares = model.system.operators.modes[0]
    omegas = np.sqrt(squares[squares > (2.0 * pi * 10.0) ** 2][:5])
    w = 2.0 * pi * f
    answers = [1.0 / (omega**2 - w**2 + 2.0j * 0.03 * omega * w) for omega in omegas]
    for m, n in product(range(1, 6), repeat=2):
        at_middle = np.sin(0.5 * m * pi) * np.sin(0.5 * n * pi) * (2.0 / (DENSITY * AREA * BEAM)) ** 2
        cross = np.real(answers[m - 1] * np.conj(answers[n - 1]))
        total += 0.02 * at_middle * BEAM**2 * exact(m, n, 0.1, BEAM) * cross
    wanted = float(np.sqrt(np.trapezoid(total, f)))
    assert found["low"] <= wanted <= found["high"]
    assert found["high"] - found["low"] < 0.3 * wanted
