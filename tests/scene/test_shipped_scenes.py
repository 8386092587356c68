"""Shipped files of several structures as users run them, against scripts of numpy and scipy that share no code."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sl
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import gapbeam as gb
from gapbeam.interface.case_fmu import live_model
from gapbeam.postprocess.report.sections.run_section import case_section

FOLDER = Path(__file__).parents[2] / "cases" / "scenes"
SHIPPED = sorted(path.name for path in FOLDER.glob("*.toml"))
Array = np.ndarray


def driven(t: Any, amplitude: float, frequency: float, ramp: float) -> Any:
    """Return a sine that begins with 10 s^3 - 15 s^4 + 6 s^5."""
    s = np.clip(t / ramp, 0.0, 1.0)
    return amplitude * np.sin(2.0 * np.pi * frequency * t) * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)


def short(name: str) -> float:
    """Return the time of 200 steps, s."""
    return 200.0 * float(tomllib.loads((FOLDER / name).read_text())["time"]["step"])


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_file_is_checked_and_run(name: str, tmp_path: Path) -> None:
    """A short run ends with exit status 0, with records of all that was marched, and the file that gives them again."""
    assert "first frequencies" in str(gb.check(FOLDER / name))
    outcome = gb.run(FOLDER / name, {"time.end": short(name)}, output=tmp_path / "out")
    assert outcome.exit_status == 0, outcome.message
    history = gb.open_results(tmp_path / "out").history
    assert history.time[-1] == pytest.approx(short(name))
    again = gb.run(tmp_path / "out" / "case.toml", output=tmp_path / "again")
    assert gb.open_results(again).history.identical(history)


def test_the_report_of_a_file_marches_other_values_and_names_its_overrides(tmp_path: Path) -> None:
    """The stiffness of the run, no key of its file, is in the live model and in the command that repeats it."""
    gb.run(FOLDER / "clip.toml", {"time.end": short("clip.toml"), "pad.stiffness": 3e5}, output=tmp_path / "out")
    found = live_model(tmp_path / "out")
    assert found is not None
    assert [one["start"] for one in found["variables"] if one["name"] == "pad.stiffness"] == [3e5]
    section = case_section(gb.open_results(tmp_path / "out"))
    assert section is not None
    assert "--set pad.stiffness=300000.0" in str(section.blocks[0])


def test_the_arm_has_the_frequencies_that_calculix_prints() -> None:
    """Seven digits of its own run with the root clamped, against its free matrices clamped here."""
    files = {key: FOLDER / f"arm.{suffix}" for key, suffix in (("stiffness", "sti"), ("mass", "mas"), ("dofs", "dof"))}
    arm = gb.read_structure(**files, nodes=FOLDER / "arm.inp", units="mm-t-s", clamped=["ROOT"])
    found = np.sqrt(arm.modes[0][:4]) / (2.0 * np.pi)
    assert found == pytest.approx([62.23582, 300.7906, 454.7286, 1377.816], rel=3e-7)


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_file_is_plotted_and_reported(name: str, tmp_path: Path) -> None:
    """Figures, and a report that names all contacts."""
    gb.run(FOLDER / name, {"time.end": short(name)}, output=tmp_path / "out")
    assert any(path.name == "time_history.png" for path in gb.plot(tmp_path / "out"))
    [page] = [Path(path) for path in gb.report(tmp_path / "out") if str(path).endswith(".html")]
    text = page.read_text(encoding="utf-8")
    for contact in gb.scene(FOLDER / name).contacts:
        assert contact.name in text


def modes_of(name: str) -> dict[str, Array]:
    table = np.genfromtxt(FOLDER / f"{name}.csv", delimiter=",", names=True)
    return {str(key): np.atleast_1d(table[key]) for key in table.dtype.names}


def test_the_clip_follows_adaptive_integration_of_its_modes() -> None:
    """Preload from one equation, then eight modes with both contacts by an adaptive Runge-Kutta method."""
    clip, panel = modes_of("clip"), modes_of("panel")
    w = 2.0 * np.pi * np.concatenate([clip["frequency"], panel["frequency"]])
    B, part = np.concatenate([clip["tip"], -panel["middle"]]), np.concatenate([clip["frame"], panel["frame"]])
    zeta, flexibility = np.concatenate([clip["damping"], panel["damping"]]), float(np.sum((B / w) ** 2))
    stiff, chi = 4e5, 0.5

    def force(r: float, v: float) -> float:
        """Return the force on the clip along its motion."""
        pad, hook = max(r + 1.5e-3, 0.0), max(-r - 1.9e-3, 0.0)
        return stiff * (hook**1.5 * (1.0 - chi * v) - pad**1.5 * (1.0 + chi * v))

    at_rest = brentq(lambda r: r - flexibility * force(r, 0.0), -1.5e-3, 0.0, xtol=1e-18, rtol=1e-14)
    scene = gb.scene(FOLDER / "clip.toml")
    seated = gb.seat(scene)
    assert -seated.F[0, 0] == pytest.approx(-force(at_rest, 0.0), rel=1e-9)

    def rate(t: float, y: Array) -> Array:
        q, v = y[:8], y[8:]
        pushed = B * force(float(B @ q), float(B @ v)) - part * driven(t, 120.0, 24.0, 0.1)
        return np.concatenate([v, pushed - 2.0 * zeta * w * v - w * w * q])

    start, end = np.concatenate([B / w**2 * force(at_rest, 0.0), np.zeros(8)]), 0.12
    found = gb.history(scene, 1e-5, end, seated)
    times = found.t[99::100]
    exact = solve_ivp(
        rate, (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-9, atol=1e-12, max_step=2e-4
    )
    tip, middle = clip["tip"] @ exact.y[:4], panel["middle"] @ exact.y[4:8]
    assert np.abs(found.displacement["tip"][99::100] - tip).max() < 1e-3 * np.abs(tip).max()
    assert np.abs(found.displacement["middle"][99::100] - middle).max() < 1e-3 * np.abs(middle).max()
    assert np.any(found.force["hook"] > 0.0)


def rack_matrices() -> tuple[Array, Array, list[str], dict[str, Array], dict[str, list[str]]]:
    """Return K, M (m, kg, s), labels, coordinates and sets of the rack, read by hand."""
    labels = (FOLDER / "rack.dof").read_text(encoding="utf-8").split()
    matrices = []
    for suffix in ("sti", "mas"):
        i, j, value = np.loadtxt(FOLDER / f"rack.{suffix}", unpack=True)
        A = np.zeros((len(labels), len(labels)))
        A[i.astype(int) - 1, j.astype(int) - 1] = value
        A = A + A.T - np.diag(np.diag(A))
        unit = np.array([1e-3 if label.endswith((".1", ".2", ".3")) else 1.0 for label in labels])
        matrices.append(1e3 * 1e-6 * A / np.outer(unit, unit))  # t mm^2 / s^2 to kg m^2 / s^2
    places: dict[str, Array] = {}
    sets: dict[str, list[str]] = {}
    kind = ""
    for line in (FOLDER / "rack.inp").read_text(encoding="utf-8").splitlines():
        if line.startswith("*"):
            kind = line.upper().replace(" ", "")
        elif kind.startswith("*NODE"):
            node, *at = line.replace(",", " ").split()
            places[node] = np.array(at, dtype=float)
        elif "NSET=" in kind:
            sets.setdefault(kind.partition("NSET=")[2], []).extend(line.replace(",", " ").split())
    return matrices[0], matrices[1], labels, places, sets


def test_the_rack_follows_adaptive_integration_of_its_matrices() -> None:
    """Matrices read by hand, clamped, with damping ratios, mat and stops: the same motion before and after stops."""
    K, M, labels, _, sets = rack_matrices()
    free = [i for i, label in enumerate(labels) if label.split(".")[0] not in sets["ROOT"]]
    along = np.array([1.0 if label.endswith(".1") else 0.0 for label in labels])
    inertia = (M @ along)[free]
    K, M = K[np.ix_(free, free)], M[np.ix_(free, free)]
    squares, X = sl.eigh(K, M)
    scene = gb.scene(FOLDER / "rack.toml")
    assert scene.structures[0].modes[0][:6] == pytest.approx(squares[:6], rel=1e-6)
    top = np.array([1.0 / len(sets["TOP"]) if label in {f"{n}.1" for n in sets["TOP"]} else 0.0 for label in labels])
    kept = squares < (2.0 * np.pi * 3e3) ** 2  # faster modes follow statically
    row, part, w = (top[free] @ X)[kept], (inertia @ X)[kept], np.sqrt(squares[kept])
    n, box = len(w), 1.5

    def rate(t: float, y: Array) -> Array:
        q, r, v, s = y[:n], y[n], y[n + 1 : -1], y[-1]
        x, speed = r - row @ q, s - row @ v
        deep = max(abs(x) - 2e-3, 0.0)
        push = np.sign(x) * max(2e7 * deep**1.5 * (1.0 + 0.4 * np.sign(x) * speed), 0.0) + 500.0 * x + 2.0 * speed
        ground = driven(t, 6.0, 4.0, 0.25)
        inner = row * push - part * ground - 0.02 * w * v - w * w * q
        return np.concatenate([v, [s], inner, [-push / box - ground]])

    end = 0.4
    found = gb.history(scene, 4e-5, end)
    times = found.t[24::25]
    exact = solve_ivp(rate, (0.0, end), np.zeros(2 * n + 2), "DOP853", times, rtol=1e-8, atol=1e-11, max_step=1e-3)
    moved = exact.y[n]
    assert np.any(np.abs(found.force["stops"]) > 0.0)
    assert np.abs(found.displacement["at"][24::25] - moved).max() < 0.01 * np.abs(moved).max()


def euler_modes(pinned: bool, count: int) -> tuple[Array, Any]:
    """Return wave numbers times the length, and shapes at a part of the length with mean square 1."""
    if pinned:
        numbers = np.pi * np.arange(1, count + 1)
        return numbers, lambda s: np.sqrt(2.0) * np.sin(numbers * s)
    numbers = np.array(
        [brentq(lambda b: np.cos(b) - 1.0 / np.cosh(b), (k + 0.5) * np.pi - 0.3, (k + 0.5) * np.pi + 0.3, xtol=1e-13)
         for k in range(1, count + 1)]
    )  # fmt: skip
    share = (np.cosh(numbers) - np.cos(numbers)) / (np.sinh(numbers) - np.sin(numbers))

    def shapes(s: float) -> Array:
        x = numbers * s
        return np.cosh(x) - np.cos(x) - share * (np.sinh(x) - np.sin(x))

    return numbers, shapes


def test_two_tubes_have_the_frequencies_and_the_first_impact_of_slender_beams() -> None:
    """Euler-Bernoulli modes in closed form, within what shear and rotation do; they meet at the same instant."""
    outer, wall, length, young, density = 0.019, 1.2e-3, 1.2, 1.95e11, 8000.0
    area = np.pi / 4.0 * (outer**2 - (outer - 2 * wall) ** 2)
    second = np.pi / 64.0 * (outer**4 - (outer - 2 * wall) ** 4)
    slow = np.sqrt(young * second / (density * area)) / length**2
    scene = gb.scene(FOLDER / "two-tubes.toml")
    for structure, pinned in zip(scene.structures, (False, True), strict=True):
        numbers, _ = euler_modes(pinned, 3)
        ratios = np.sqrt(structure.modes[0][:3]) / (slow * numbers**2)
        assert np.all(np.diff(ratios) < 0.0)  # shear and rotation make beams softer, the more the shorter their waves
        assert np.all((ratios < 1.0) & (ratios > [0.995, 0.99, 0.98]))
    numbers, shapes = euler_modes(False, 9)
    w, at = slow * numbers**2, shapes(0.5)
    times = np.linspace(0.0, 0.05, 20001)

    def rate(t: float, y: Array) -> Array:
        push = at / (density * area * length) * driven(t, 25.0, 70.0, 0.05)
        return np.concatenate([y[9:], push - 0.01 * w * y[9:] - w * w * y[:9]])

    moved = at @ solve_ivp(rate, (0.0, 0.05), np.zeros(18), "DOP853", times, rtol=1e-8, atol=1e-12).y[:9]
    touch = times[int(np.flatnonzero(moved > 0.4e-3)[0])]
    found = gb.history(scene, 1e-5, 0.05)
    first = {name: found.t[np.flatnonzero(found.force[name])[0]] for name in ("middle", "side")}
    assert first["middle"] == pytest.approx(touch, rel=0.01)
    assert first["side"] > first["middle"]
    before = found.t < 0.95 * touch
    given = np.interp(found.t[before], times, moved)
    assert np.abs(found.displacement["driven.mid"][before] - given).max() < 0.02 * np.abs(given).max()


def bracket_matrices() -> tuple[Array, Array, dict[str, list[int]]]:
    """Return K and M (N/m, kg) and sets of the bracket: straight tetrahedra of order 2, cell by cell."""
    blocks: dict[str, list[list[float]]] = {}
    for line in (FOLDER / "bracket.inp").read_text(encoding="utf-8").splitlines():
        if line.startswith("*"):
            here = blocks.setdefault(line.upper().replace(" ", ""), [])
        elif not line.startswith(("Abaqus", "written")):
            here.append([float(one) for one in line.replace(",", " ").split()])
    x = 1e-3 * np.array(blocks["*NODE"])[:, 1:]
    cells = np.array([one for key in blocks if key.startswith("*ELEMENT") for one in blocks[key]], dtype=int)[:, 1:] - 1
    sets = {key.rpartition("=")[2]: [int(i) - 1 for row in rows for i in row]
            for key, rows in blocks.items() if "SET=" in key}  # fmt: skip
    edges = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
    a, b = 0.58541019662496852, 0.13819660112501050
    points = np.where(np.eye(4) == 1.0, a, b)
    lengths = np.arange(10)
    both = np.array([[6 if i == j else 1 for j in lengths[:4]] for i in lengths[:4]])
    whole = np.zeros((10, 10))  # integral of N_i N_j over a cell, of its volume / 420: Zienkiewicz, with all products
    whole[:4, :4] = both
    for k, (i, j) in enumerate(edges, 4):
        whole[:4, k] = whole[k, :4] = [-4 if n in (i, j) else -6 for n in range(4)]
        for n, other in enumerate(edges, 4):
            whole[k, n] = 32 if n == k else 16 if set(other) & {i, j} else 8
    K, M = np.zeros((3 * len(x), 3 * len(x))), np.zeros((3 * len(x), 3 * len(x)))
    soft = set(sets["RUBBER"])
    for number, cell in enumerate(cells):
        E, nu, rho = (2e7, 0.45, 1200.0) if number in soft else (2.1e11, 0.3, 7850.0)
        J = np.vstack([np.ones(4), x[cell[:4]].T])
        volume, slope = np.linalg.det(J) / 6.0, np.linalg.inv(J)[:, 1:]
        k = np.zeros((10, 3, 10, 3))
        for L in points:
            G = np.array([*((4 * L[i] - 1) * slope[i] for i in range(4)),
                          *(4 * (L[i] * slope[j] + L[j] * slope[i]) for i, j in edges)])  # fmt: skip
            lame, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
            k += volume / 4 * (lame * np.einsum("ia,jb->iajb", G, G) + mu * np.einsum("ib,ja->iajb", G, G)
                               + mu * np.einsum("ic,jc,ab->iajb", G, G, np.eye(3)))  # fmt: skip
        at = (3 * cell[:, None] + np.arange(3)).ravel()
        K[np.ix_(at, at)] += k.reshape(30, 30)
        M[np.ix_(at, at)] += rho * volume / 420.0 * np.kron(whole, np.eye(3))
    return K, M, sets


@pytest.mark.slow(minutes=0.4)
def test_the_bracket_follows_adaptive_integration_of_its_cells() -> None:
    """Frequencies of cells summed by hand to 1e-6, and the pad before and after it strikes its stop."""
    K, M, sets = bracket_matrices()
    free = np.setdiff1d(np.arange(len(K)), [3 * i + k for i in sets["ROOT"] for k in range(3)])
    row, along = np.zeros(len(K)), np.zeros(len(K))
    row[[3 * i + 2 for i in sets["TIP"]]], along[2::3] = 1.0 / len(sets["TIP"]), 1.0
    inertia = (M @ along)[free]
    K, M, row = K[np.ix_(free, free)], M[np.ix_(free, free)], row[free]
    squares, X = sl.eigh(K, M, subset_by_index=[0, 14])
    scene = gb.scene(FOLDER / "bracket.toml")
    assert scene.structures[0].modes[0][:15] == pytest.approx(squares, rel=1e-6)
    Q = np.column_stack([X, np.linalg.solve(K - 0.1 * -squares[0] * M, row)])  # the static response, as shifted there
    squares, Y = sl.eigh(Q.T @ K @ Q, Q.T @ M @ Q)
    at, part, w = row @ Q @ Y, inertia @ Q @ Y, np.sqrt(squares)
    n = len(w)

    def rate(t: float, y: Array) -> Array:
        depth, speed = at @ y[:n] - 2e-4, at @ y[n:]
        force = max(5e5 * depth + 20.0 * speed, 0.0) if depth > 0.0 else 0.0
        push = -part * driven(t, 150.0, 250.0, 0.02) - at * force
        return np.concatenate([y[n:], push - 0.02 * w * y[n:] - w * w * y[:n]])

    found = gb.history(scene, 5e-6, 0.04)
    assert np.abs(found.force["stop"]).max() > 5.0
    given = at @ solve_ivp(rate, (0.0, 0.04), np.zeros(2 * n), "DOP853", found.t, rtol=1e-8, atol=1e-13).y[:n]
    assert np.abs(found.displacement["pad"] - given).max() < 0.01 * np.abs(given).max()


def test_all_files_are_covered() -> None:
    """Files of this folder are those that the tests above and in `test_feedback_files` and `test_frames` know."""
    flows = ["freeplay-flutter.toml", "tube-fluidelastic.toml"]
    known = ["arm.toml", "bracket.toml", "clip.toml", "rack.toml", "two-tubes.toml", "pipe-route.toml"]
    assert sorted([*known, *flows]) == SHIPPED
