"""A pin with play in a bore: a joint between two structures from matrices, rough and smooth, against SciPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy

import gapbeam as gb
from gapbeam.solver.system.operators import Array
from tests.shared.slips import Tables

CLEARANCE, STIFFNESS, CHI, CREEP = 2e-4, 4e9, 3.0, 2e-3
PUSH, RATE = 120.0, 17.0  # N, Hz


def arm(seed: int) -> tuple[Array, Array, Array]:
    """Return M, K and C of two nodes in a plane: masses, and springs to the frame and between them in any direction."""
    draw = np.random.default_rng(seed)
    springs = [one @ one.T for one in draw.uniform(-1.0, 1.0, (3, 2, 2))]
    K = 1e5 * np.block([[springs[0] + springs[2], -springs[2]], [-springs[2], springs[1] + springs[2]]])
    M = np.diag(np.repeat(draw.uniform(0.5, 2.0, 2), 2))
    return M, K, 2e-4 * K


def files(folder: Path, friction: float) -> Tables:
    """Return the tables of two arms; the pushed tip of the first is a pin in a bore of the second."""
    (folder / "arm.dof").write_text("1.1\n1.3\n2.1\n2.3\n")
    (folder / "arm.txt").write_text("1 0 0 0\n2 0.1 0 0\n")
    for name, seed in (("pin", 1), ("bore", 2)):
        for key, matrix in zip("MKC", arm(seed), strict=True):
            np.save(folder / f"{name}-{key}.npy", matrix)
    return {
        "structure": [
            {"name": name, "model": {"type": "matrices", "units": "m-kg-s", "dofs": str(folder / "arm.dof"),
                                     "nodes": str(folder / "arm.txt"), **{
                key: str(folder / f"{name}-{part}.npy")
                for key, part in (("mass", "M"), ("stiffness", "K"), ("damping", "C"))}}}
            for name in ("pin", "bore")
        ],
        "point": [{"name": "tip", "structure": name, "node": 2, "direction": [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]}
                  for name in ("pin", "bore")],
        "pair": [{"name": "joint", "between": ["pin.tip", "bore.tip"], "friction": friction, "sliding": CREEP,
                  "region": {"type": "disc", "clearance": CLEARANCE},
                  "law": {"type": "hunt-crossley", "stiffness": STIFFNESS, "chi": CHI}}],
        "load": [{"type": "harmonic_force", "name": f"push {way}".replace(" ", "-"), "point": "pin.tip",
                  "direction": list(map(float, np.eye(2)[way])), "amplitude": PUSH, "frequency": RATE * (1 + way),
                  "ramp": 0.0} for way in (0, 1)],
        "time": {"step": 1e-5, "end": 0.04},
    }  # fmt: skip


def turned(friction: float, times: Array) -> Array:
    """Return the place of the pin in its bore, (times, 2), by SciPy."""
    (Ma, Ka, Ca), (Mb, Kb, Cb) = arm(1), arm(2)
    M, K, C = (scipy.linalg.block_diag(*pair) for pair in ((Ma, Mb), (Ka, Kb), (Ca, Cb)))
    B = np.zeros((2, 8))
    B[:, 2:4], B[:, 6:8] = np.eye(2), -np.eye(2)

    def slopes(t: float, s: Array) -> Array:
        u, v = s[:8], s[8:]
        r, w = B @ u, B @ v
        far = float(np.linalg.norm(r))
        force = np.zeros(2)
        if far > CLEARANCE:
            n = r / far
            slip = float(w @ [-n[1], n[0]])
            press = max(0.0, STIFFNESS * (far - CLEARANCE) ** 1.5 * (1.0 + CHI * float(w @ n)))
            force = -press * (n + friction * slip / np.hypot(slip, CREEP) * np.array([-n[1], n[0]]))
        acting = B.T @ force - K @ u - C @ v
        acting[2:4] += PUSH * np.sin(2.0 * np.pi * RATE * np.array([1.0, 2.0]) * t)
        return np.concatenate([v, np.linalg.solve(M, acting)])

    found = scipy.integrate.solve_ivp(slopes, (0.0, times[-1]), np.zeros(16), "LSODA", times, rtol=1e-8, atol=1e-11,
                                      max_step=1e-4)  # fmt: skip
    return np.asarray((B @ found.y[:8]).T)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_pin_turns_in_its_bore(tmp_path: Path, friction: float) -> None:
    """The place of the pin within 1 % of the play at 1e-5 s, of order 2, through many impacts."""
    scene, errors = gb.scene(files(tmp_path, friction)), []
    wanted = turned(friction, 1e-5 * np.arange(1, 4001))
    for every in (2, 1):
        found = gb.history(scene, every * 1e-5, 0.04)
        place = found.displacement["pin.tip"] - found.displacement["bore.tip"]
        errors.append(np.abs(place - wanted[every - 1 :: every]).max() / CLEARANCE)
    assert errors[1] < 0.01, errors
    assert errors[0] > 3.5 * errors[1], errors
    felt = np.linalg.norm(found.force["joint"], axis=1) > 0.0
    assert np.count_nonzero(np.diff(felt.astype(int)) == 1) > 5
    assert np.ptp(np.unwrap(np.arctan2(*place[felt].T))) > np.pi
    assert abs(found.last.balance) < 1e-11 * found.last.energy["loads"]
