"""Random loads in files of structures, beside a flow: statistics, works and loads against closed forms."""

from __future__ import annotations

from functools import partial
from math import pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.linalg import solve_continuous_lyapunov

import gapbeam as gb
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.run.scene_run import SceneMarch
from tests.shared import slips
from tests.shared.slips import Change, Tables, check_slip

MASS, STIFFNESS, DAMPING, DENSITY = 1.0, (2 * pi * 20.0) ** 2, 1.0, 0.5
U, RHO, D, K, C, A, RATE = 3.0, 1.2, 0.04, -300.0, 100.0, 0.6, 0.2


def oscillator(end: float) -> Tables:
    """Return a mass on a spring in a flow with a memory, under white noise."""
    return {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": MASS, "stiffness": STIFFNESS,
                                                "damping": DAMPING}}],
        "feedback": [{"name": "flow", "type": "unsteady", "point": "box.at", "velocity": U, "density": RHO,
                      "diameter": D, "stiffness": K, "damping": C, "amplitudes": [A], "rates": [RATE]}],
        "load": [{"type": "random", "name": "turbulence", "point": "box.at",
                  "spectrum": {"type": "white", "density": DENSITY, "high": 500.0}}],
        "time": {"step": 5e-4, "end": end},
        "output": {"history_interval": 2e-3},
    }  # fmt: skip


def test_variance_and_works_under_noise_are_those_of_a_lyapunov_equation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A P + P A^T + S / 2 b b^T = 0 of (y, v, z); the noise does the work S / (4 m) a second, the flow what is left."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    q = 0.5 * RHO * U * U
    matrix = np.array([
        [0.0, 1.0, 0.0],
        [(q * K - STIFFNESS) / MASS, -(DAMPING + q * D / U * C) / MASS, -q * K * A / MASS],
        [0.0, 1.0, -RATE * U / D],
    ])  # fmt: skip
    kick = np.array([[0.0], [1.0 / MASS], [0.0]])
    P = solve_continuous_lyapunov(matrix, -0.5 * DENSITY * kick @ kick.T)
    outcome = gb.run(oscillator(80.0), output=tmp_path / "run")
    assert outcome.exit_status == 0
    figures = {one["name"]: one for one in outcome.summary["statistics"]["figures"]}
    rms = figures["probe.at.rms"]
    assert rms["verdict"] == "good"
    assert rms["low"] < sqrt(P[0, 0]) < rms["high"]
    assert rms["high"] / rms["low"] < 1.3
    still = sqrt(DENSITY / (4.0 * DAMPING * STIFFNESS))
    assert not rms["low"] < still < rms["high"]  # without the flow
    history = gb.open_results(tmp_path / "run").history["load_work"].isel(time=-1)
    works = {name: float(history.sel(load=name)) / 80.0 for name in ("turbulence", "flow")}
    assert works["turbulence"] == pytest.approx(DENSITY / (4.0 * MASS), rel=0.15)
    lost = DAMPING * P[1, 1]
    assert works["flow"] == pytest.approx(lost - DENSITY / (4.0 * MASS), rel=0.15)
    words = f"work of the flow {80 * works['flow']:.4g} J, of turbulence {80 * works['turbulence']:.4g} J"
    assert words in outcome.message
    assert outcome.summary["random_loads"][0]["name"] == "turbulence"


def test_a_contact_that_never_opens_has_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pressed mass under noise: mean force P k / (k + K) in its interval, good; only events are none.

    Variance of the motion is that of white noise: S / (4 c (k + K)).
    """
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    given = oscillator(60.0)
    del given["feedback"]
    given["structure"][0]["model"] |= {"stiffness": 4000.0, "damping": 35.0}
    given["pair"] = [{"name": "stop", "between": ["box.at"], "region": {"type": "half-plane", "clearance": 0.0},
                      "law": {"type": "kelvin-voigt", "stiffness": 1e4, "damping": 5.0}}]  # fmt: skip
    press = {"type": "constant_force", "name": "press", "point": "box.at", "amplitude": 100.0}
    given |= {"load": [press, *given["load"]], "start": {"state": "seat"}, "time": {"step": 2e-3, "end": 60.0}}
    given["load"][1]["spectrum"]["high"] = 120.0
    found = gb.run(given, output=tmp_path / "run").summary["statistics"]["figures"]
    figures = {one["name"]: one for one in found}
    events = {"contact_share", "impact_rate", "impact_duration", "impact_impulse", "approach_speed"}
    verdicts = {name: one["verdict"] for name, one in figures.items()}
    assert verdicts == {name: "no event" if name.rpartition(".")[2] in events else "good" for name in figures}
    assert figures["face.stop.mean_force"]["low"] < 100.0 / 1.4 < figures["face.stop.mean_force"]["high"]
    spread = sqrt(DENSITY / (4.0 * 40.0 * 1.4e4))
    assert figures["probe.at.rms"]["low"] < spread < figures["probe.at.rms"]["high"] < 1.2 * spread


def beam() -> Tables:
    """Return a tube in two supports with a flow and turbulence along it."""
    tube = {"type": "beam", "length": 1.0, "thickness": 0.019, "section": {"type": "tube", "wall": 1.1e-3},
            "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0}, "motions": 2,
            "elements": 20}  # fmt: skip
    return {
        "structure": [{"name": "tube", "ratio": 0.01, "model": tube, "reduce": {"modes": 8}}],
        "point": [{"name": "mid", "structure": "tube", "at": 0.5},
                  {"name": "quarter", "structure": "tube", "at": 0.25}],
        "joint": [{"type": "pinned", "structure": "tube", "at": x} for x in (0.0, 1.0)],
        "pair": [{"name": "hole", "between": ["tube.mid"], "region": {"type": "disc", "clearance": 2e-5},
                  "law": {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 10.0}}],
        "feedback": [{"name": "flow", "type": "quasi-steady", "span": {"structure": "tube"}, "velocity": 3.0,
                      "density": 100.0, "diameter": 0.019, "drag": 1.0, "slope": [[0.0, 0.0], [0.0, -0.5]],
                      "delay": 0.0, "frequency": 500.0}],
        "load": [
            {"type": "random-line-load", "name": name, "structure": "tube", "span": [0.0, 1.0], "direction": along,
             "spectrum": {"type": "white", "density": 0.5, "high": 400.0},
             "coherence": {"type": "exponential", "length": 0.1}}
            for name, along in (("drag", [1.0, 0.0]), ("lift", [0.0, 2.0]))
        ],
        "wear": {"coefficient": 2e-14, "area": 1e-5},
        "time": {"step": 1e-4, "end": 0.6},
        "output": {"history_interval": 4e-4},
    }  # fmt: skip


def test_noise_along_a_tube_has_the_joint_acceptance_of_its_modes() -> None:
    """Equation sum_k (phi . f_k)^2 = int int phi rho phi dx dx', by quadrature; each load in its own plane."""
    scene = gb.scene(beam())
    along = {name: [one for one in scene.loads if one.name.startswith(name)] for name in ("drag", "lift")}
    tube = scene.structures[0]
    squares, shapes = tube.modes[0][:4], tube.modes[2][:, :4]
    assert squares[1] == pytest.approx(squares[0], rel=1e-9)  # the same mode in both planes
    forces = {name: shapes.T @ np.stack([one.pattern for one in loads]).T for name, loads in along.items()}

    def shared(y: float, x: float, n: int) -> float:
        return float(np.sin(n * pi * x) * np.sin(n * pi * y) * np.exp((y - x) / 0.1))

    for n, mine in ((1, slice(0, 2)), (2, slice(2, 4))):
        acceptance = 2.0 * dblquad(shared, 0.0, 1.0, 0.0, lambda x: x, args=(n,))[0]  # the half below x = y is as large
        at = tube["quarter"].rows @ shapes[:, mine] / sin(n * pi / 4)
        for name, plane in (("drag", 0), ("lift", 1)):
            assert np.sum(forces[name][mine] ** 2) == pytest.approx(np.sum(at[plane] ** 2) * acceptance, rel=1e-3)


def test_a_tube_under_turbulence_and_flow_has_statistics_and_wear_and_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every figure has an interval; an interrupted run ends with the same figures; loads are named together."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    whole = gb.run(beam(), output=tmp_path / "whole")
    figures = {one["name"]: one for one in whole.summary["statistics"]["figures"]}
    history = gb.open_results(tmp_path / "whole").history
    assert {"face.hole.impact_rate", "face.hole.rms_force", "probe.mid.rms", "probe.mid.lateral_rms"} <= set(figures)
    for name, component in (("probe.mid.rms", "z"), ("probe.mid.lateral_rms", "y")):
        one, moved = figures[name], history["displacement"].sel(probe="mid", component=component)
        assert one["low"] < one["value"] < one["high"]
        late = moved.values[moved["time"].values > whole.summary["statistics"]["burn_in"]]
        assert one["value"] == pytest.approx(float(late.std()), rel=0.02)
    assert (
        float(history["load_work"].sel(load="all loads")[-1]) > 0.0 > float(history["load_work"].sel(load="flow")[-1])
    )
    assert whole.summary["wear"]["faces"]["hole"]["work_rate"]["high"] > 0.0
    names = [one["name"] for one in whole.summary["random_loads"]]
    assert names == ["drag", "lift"]
    heard = Stopper(monkeypatch, 3)
    stopped = gb.run(beam(), output=tmp_path / "part")
    assert heard.count >= 3
    assert stopped.exit_status != 0
    monkeypatch.undo()
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    again = gb.run(beam(), output=tmp_path / "part", resume=True)
    assert again.summary["resumed"]
    assert again.summary["statistics"] == whole.summary["statistics"]
    assert again.summary["wear"] == whole.summary["wear"]


class Stopper:
    """Asks a run to stop at its n-th block."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, last: int) -> None:
        self.count, self.last = 0, last
        monkeypatch.setattr(SceneMarch, "_listen", self.listen)

    def listen(self) -> None:
        """Count, and stop."""
        self.count += 1
        if self.count >= self.last:
            raise Interrupted("asked by a test", 143)


put = partial(slips.put, "load")
SLIPS: dict[str, tuple[Change, str, str]] = {
    "an unknown tube": (put(0, "structure", value="tub"), "drag.*structure", "did you mean"),
    "no tube": (put(0, "structure", value=None), "drag.*structure", "missing"),
    "beyond the end": (put(0, "span", value=[0.0, 1.5]), "drag.*span", "from 0 to 1 m"),
    "no length": (put(0, "span", value=[0.5, 0.5]), "drag.*span", "behind the begin|two different"),
    "one direction of two": (put(0, "direction", value=[1.0]), "drag.*direction", "a number for each motion"),
    "no coherence": (put(0, "coherence", value=None), "drag.*coherence", "missing"),
    "a cross-spectrum with nothing": (put(0, "cross_spectrum", value={"load": "pull", "coherence": 0.5}),
                                      "drag.*load", "no load is called"),
    "a step as long as the noise": (lambda given, _: given["time"].update(step=2e-3), "step", "half the period"),
    "noise at no point": (put(0, value={"type": "random", "name": "kick", "point": "tube.end", "spectrum": {
        "type": "white", "density": 1.0, "high": 100.0}}), "kick.*point", "tube.mid"),
    "noise that shakes a point": (put(0, value={"type": "random", "name": "kick", "point": "tube.mid", "quantity":
        "acceleration", "spectrum": {"type": "white", "density": 1.0, "high": 100.0}}), "kick.*quantity", "force"),
    "a spectrum that is no file": (put(0, "spectrum", value={"type": "file", "file": "none.csv"}), "drag.*file",
                                   "none.csv"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_of_noise_are_refused_by_their_key(tmp_path: Path, slip: str) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given: dict[str, Any] = beam()
    check_slip(given, SLIPS[slip], tmp_path)
