"""[[feedback]] in files: the forces that Python makes, what check and run say, every slip refused by its key."""

from __future__ import annotations

from functools import partial
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.charts import Chart
from gapbeam.postprocess.report.sections.run_section import flow_section
from gapbeam.postprocess.report.sections.verdict_section import scene_table
from gapbeam.solver.diagnostics.statistics.batch_interval import burn_in
from tests.shared import slips
from tests.shared.slips import Change, Tables, check_slip

STEEL = {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 7850.0}
STREAM = {"velocity": 3.0, "density": 1000.0}
TUBE = {**STREAM, "diameter": 0.019}


def tables(folder: Path) -> Tables:
    """Return a sound file with every kind of force, on spans and at points."""
    reduced = np.linspace(1.0, 40.0, 12)
    k = 2j * pi / reduced
    c = -2.0 - 0.7 * k + 1.3 * k / (k + 0.4)
    rows = np.column_stack([reduced, c.real, c.imag])
    np.savetxt(folder / "c.csv", rows, delimiter=",", header="U/fD,re,im")
    line = "frequency,damping," + ",".join(f"s{i}" for i in range(5))
    shapes = [",".join(f"{sqrt(2.0) * np.sin(pi * n * i / 4):.9f}" for i in range(5)) for n in (1, 2)]
    (folder / "arm.csv").write_text("\n".join([line, f"30.0,0.01,{shapes[0]}", f"90.0,0.01,{shapes[1]}"]) + "\n")
    profile = [[0.0, 1.0], [0.5, 1.0], [1.0, 1.2]]
    return {
        "structure": [
            {"name": "tube", "ratio": 0.01, "model": {
                "type": "beam", "length": 1.0, "thickness": 0.019, "section": {"type": "tube", "wall": 1.1e-3},
                "material": dict(STEEL), "added_mass": 0.3, "elements": 20}},
            {"name": "arm", "model": {"type": "modes", "file": str(folder / "arm.csv")}},
            {"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e4, "damping": 4.0}},
        ],
        "point": [{"name": "mid", "structure": "tube", "at": 0.5}],
        "joint": [{"type": "pinned", "structure": "tube", "at": x} for x in (0.0, 1.0)],
        "contact": {"law": {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 10.0}},
        "pair": [{"name": "support", "between": ["tube.mid"], "region": {"type": "slot", "clearance": 4e-4}}],
        "feedback": [
            {"name": "steady", "type": "quasi-steady", **TUBE, "span": {"structure": "tube", "velocity": profile},
             "drag": 1.0, "slope": -0.5, "frequency": 100.0, "tolerance": 1e-2, "modes": 4},
            {"name": "memory", "type": "unsteady", **TUBE, "span": {"structure": "tube", "from": 0.25, "to": 0.75},
             "stiffness": -0.1, "damping": 0.2, "amplitudes": [0.3], "rates": [0.1]},
            {"name": "table", "type": "measured", **TUBE, "file": str(folder / "c.csv"), "frequencies": [20.0, 60.0],
             "span": {"structure": "arm", "points": [f"s{i}" for i in range(5)], "at": [0.0, 0.1, 0.2, 0.3, 0.4]}},
            {"name": "lag", "type": "aerodynamic-lag", **STREAM, "points": ["box.at"], "half_chord": 0.1,
             "steady": [[-0.1]], "damping": [[-0.2]], "lags": [0.3], "matrices": [[[0.05]]]},
            {"name": "brake", "type": "controller", "sense": ["box.at"], "act": ["arm.s2"], "A": [[-50.0]],
             "B": [[10.0, 0.0]], "C": [[1.0]], "D": [[0.0, -2.0]]},
            {"name": "design", "type": "connors", **TUBE, "span": {"structure": "tube"}, "constant": 3.0,
             "mass": 0.8, "decrement": 0.06},
        ],
        "load": [{"type": "harmonic_force", "name": "shaker", "point": "tube.mid", "amplitude": 5.0,
                  "frequency": 30.0}],
        "time": {"step": 1e-4, "end": 0.05},
    }  # fmt: skip


def test_a_file_has_the_forces_that_python_makes(tmp_path: Path) -> None:
    """The same matrices of motion, with spans at stations of one's own; and the same march from public nouns."""
    scene = gb.scene(tables(tmp_path))
    places = {"mid": 0.5, **{f"x{i}": i / 20 for i in range(21)}}
    section, steel = gb.section("tube", 0.019, wall=1.1e-3), gb.material(2.0e11, 7850.0)
    dry = gb.beam(1.0, section, steel, places, pinned=[0.0, 1.0], elements=20, ratio=0.01, added_mass=0.3, name="tube")
    arm = gb.read_modes(tmp_path / "arm.csv", "arm")
    box = gb.mass(2.0, stiffness=1e4, damping=4.0, name="box")
    air: dict[str, Any] = TUBE
    inner = {f"y{i}": 0.25 + i * 0.05 for i in range(11)}
    stations = {name: next(key for key, x in places.items() if abs(x - at) < 1e-9) for name, at in inner.items()}
    forces = [
        gb.quasi_steady(
            gb.span(dry, {f"x{i}": i / 20 for i in range(21)}, velocity=lambda x: np.maximum(1.0, 0.8 + 0.4 * x)),
            **air, drag=1.0, slope=-0.5, frequency=200.0 * pi, tolerance=1e-2, modes=4, name="steady",
        ),
        gb.unsteady(
            gb.span(dry, {stations[name]: x for name, x in inner.items()}), **air, stiffness=-0.1, damping=0.2,
            amplitudes=[0.3], rates=[0.1], name="memory",
        ),
        gb.measured(
            gb.span(arm, {f"s{i}": i / 10 for i in range(5)}), tmp_path / "c.csv", **air,
            frequencies=[40.0 * pi, 120.0 * pi], name="table",
        ),
        gb.aerodynamic_lag(
            box["at"], velocity=3.0, density=1000.0, half_chord=0.1, steady=-0.1, damping=-0.2, lags=[0.3],
            matrices=[0.05], name="lag",
        ),
        gb.Feedback(box["at"], arm["s2"], [[-50.0]], [[10.0, 0.0]], [[1.0]], [[0.0, -2.0]], name="brake"),
    ]  # fmt: skip
    stop = gb.Contact(dry["mid"], gb.Slot(4e-4), gb.KelvinVoigt(stiffness=1e6, damping=10.0), name="support")
    own = gb.Scene(dry, arm, box, contacts=[stop], feedbacks=forces)
    for closed in ([], ["support"]):
        slow = [values[np.abs(values) < 2e3] for values in (gb.eigenvalues(one, closed) for one in (scene, own))]
        assert len(slow[0]) == len(slow[1]) > 10
        assert all(np.abs(slow[1] - one).min() < 1e-6 * abs(one) for one in slow[0])


def test_check_says_whether_a_controller_is_unstable() -> None:
    """Growth and frequency are of the eigenvalues of m x'' + c x' + k x = C z, z' = A z + x, by hand."""
    servo = {"name": "servo", "type": "controller", "sense": ["rig.at"], "act": ["rig.at"], "A": [[-30.0]],
             "B": [[1.0, 0.0]], "C": [[-3e5]]}  # fmt: skip
    law = {"type": "kelvin-voigt", "stiffness": 5e5, "damping": 600.0}
    model = {"type": "mass", "mass": 2.0, "stiffness": 8e3, "damping": 8.0}
    stop = {"name": "stop", "between": ["rig.at"], "region": {"type": "slot", "clearance": 2e-3}, "law": law}
    sections = gb.check({"structure": [{"name": "rig", "model": model}], "pair": [stop], "feedback": [servo],
                         "time": {"step": 1e-4, "end": 0.1}}).sections  # fmt: skip
    assert sections["contacts"] == (("stop", "Slot", "KelvinVoigt, at rig.at"),)
    states = []
    for k, c, row in zip((5.08e5, 8e3), (608.0, 8.0), sections["feedback"], strict=False):
        matrix = np.array([[0.0, 1.0, 0.0], [-k / 2.0, -c / 2.0, -1.5e5], [1.0, 0.0, -30.0]])
        value = max(np.linalg.eigvals(matrix), key=lambda one: float(one.real))
        assert row[1] == f"{value.real:.4g} 1/s, {abs(value.imag) / (2.0 * pi):.4g} Hz"
        states.append(row[2])
    assert states == ["all closed; stable", "all idle; unstable"]
    assert sections["feedback"][2][1:] == ("0 of 1", "unstable without stop")


def test_check_says_how_far_the_flow_is_from_unstable(tmp_path: Path) -> None:
    """Critical velocities of check are those of `critical_velocity`; Connors' that of his formula by hand."""
    given = tables(tmp_path)
    del given["structure"][1:], given["feedback"][2:5], given["feedback"][0]
    own = {"stiffness": 1.0, "damping": 2.0, "amplitudes": [3.0], "rates": [0.3], "velocity": 20.0}
    given["feedback"][0] |= {**own, "span": {"structure": "tube"}}
    described, scene = gb.check(given), gb.scene(given)
    rows = described.sections["flow"]
    for words, closed in (("all closed", ["support"]), ("all idle", [])):
        value = next(row[1] for row in rows if row[0] == "critical velocity" and words in row[2])
        found = gb.critical_velocity(scene, "memory.velocity", 3.0, 150.0, closed)
        how = f"{found.frequency / 2 / pi:.4g} Hz" if found.frequency else "divergence"
        assert value == f"{found.value:.4g} m/s, {how}"
    idle = next(row for row in rows if row[0] == "supports that may be idle")
    assert idle[1] == {0: "0 of 1", 1: "1 of 1"}[gb.idle_supports(scene, ["support"]).tolerated]
    first = sqrt(scene.squares[0]) / (2.0 * pi)
    critical = 3.0 * first * 0.019 * sqrt(0.8 * 0.06 / (1000.0 * 0.019**2))
    assert next(row for row in rows if "Connors" in row[0] and "idle" in row[2])[1].startswith(f"{critical:.4g} m/s")


def test_a_run_names_the_work_of_the_flow(tmp_path: Path) -> None:
    """In message, summary and records; the balance closes with it, also after a seat under the flow."""
    given = tables(tmp_path)
    given["feedback"] = given["feedback"][1:2]
    given["load"].append({"type": "gravity", "structure": "tube"})
    given["start"] = {"state": "seat"}
    outcome = gb.run(given, output=tmp_path / "run")
    work = outcome.summary["energy"]["work_of_feedback"]["memory"]
    assert outcome.exit_status == 0
    assert f"work of the flow {work:.4g} J" in outcome.message
    history = gb.open_results(tmp_path / "run").history
    assert float(history["load_work"].sel(load="memory")[-1]) == work != 0.0
    last = history.isel(time=-1)
    stored = sum(float(last[name]) for name in ("kinetic_energy", "strain_energy", "contact_energy"))
    begun = sum(float(history[name][0]) for name in ("kinetic_energy", "strain_energy", "contact_energy"))
    lost = float(last["structural_dissipation"]) + float(last["contact_dissipation"])
    assert stored - begun + lost == pytest.approx(float(last["load_work"].sum()), rel=1e-9)


def test_wear_under_a_flow_is_that_of_motion_and_force_in_a_round_hole(tmp_path: Path) -> None:
    """Archard's k sum |F_n| |slip| / A / T of a tube in two planes, from the history of its scene, written out here."""
    given = tables(tmp_path)
    del given["structure"][1:], given["feedback"][2:], given["feedback"][0]
    given["structure"][0]["model"]["motions"] = 2
    given["feedback"][0] |= {"stiffness": [[-0.1, 0.2], [-0.2, -0.1]], "damping": [[0.2, 0.0], [0.0, 0.2]]}
    given["pair"][0]["region"] = {"type": "disc", "clearance": 2e-5}
    given["load"][0]["direction"] = [0.6, 0.8]
    given["wear"] = {"coefficient": 2e-14, "area": 1e-5}
    outcome = gb.run(given, output=tmp_path / "run")
    found = outcome.summary["wear"]["faces"]["support"]
    motion = gb.history(gb.scene(given), 1e-4, 0.05)
    y, F = motion.displacement["mid"], motion.force["support"]
    normal = y / np.linalg.norm(y, axis=1)[:, None]
    slip = np.diff(y, axis=0, prepend=0.0) @ np.array([[0.0, -1.0], [1.0, 0.0]])
    work = np.abs((F * normal).sum(axis=1)) * np.abs((slip * normal).sum(axis=1))
    assert found["work"] == pytest.approx(work.sum(), rel=1e-9)
    assert work.sum() > 0.0
    late = work[burn_in([work]) :] / 1e-4
    parts = late[len(late) % 10 :].reshape(10, -1).mean(axis=1)
    apart = parts - parts.mean()
    r = np.clip(apart[1:] @ apart[:-1] / (apart @ apart) + 0.1, 0.0, 0.8)
    reach = 2.262157 * np.sqrt(parts.var(ddof=1) / 10 * (1 + r) / (1 - r)) / parts.mean()  # of Student, 9 degrees
    rate = parts.mean() * np.exp([0.0, -reach, reach])
    assert list(found["work_rate"].values()) == pytest.approx(rate, rel=1e-6)
    assert found["depth_rate"]["value"] == pytest.approx(2e-14 * rate[0] / 1e-5, rel=1e-9)
    assert found["verdict"] == "too short"


@pytest.mark.slow(minutes=0.1)
def test_a_fit_that_misses_is_stated_drawn_and_warned_of(tmp_path: Path) -> None:
    """A bump of c that no exponential has: the misfit is that of an own search of all rates; runs without contact."""
    given = tables(tmp_path)
    given = {key: given[key] for key in ("structure", "feedback", "load", "time")}
    given["structure"], given["feedback"] = [given["structure"][1]], [given["feedback"][2] | {"states": 1}]
    given["load"] = [{"type": "step_force", "name": "push", "point": "arm.s2", "amplitude": 5.0, "end": 0.01}]
    reduced = np.linspace(2.0, 40.0, 20)
    k = 2j * pi / reduced
    c = -2.0 - 0.7 * k + 1.3 * k / (k + 0.4) + 0.3 * np.exp(-((reduced - 20.0) ** 2) / 8.0)
    np.savetxt(tmp_path / "c.csv", np.column_stack([reduced, c.real, c.imag]), delimiter=",")

    def left(rate: float) -> Any:
        columns = np.stack([k**0, k, k / (k + rate)], axis=1)
        both, right = np.vstack([columns.real, columns.imag]), np.concatenate([c.real, c.imag])
        found = both @ np.linalg.lstsq(both, right, rcond=None)[0] - right
        return found[:20] + 1j * found[20:]

    rates = np.geomspace(1e-2, 30.0, 20_001)
    least = min((left(rate) for rate in rates), key=lambda one: float(np.linalg.norm(one)))
    misfit = float(np.abs(least).max() / np.abs(c).max())
    assert misfit > 0.05
    described = gb.check(given)
    assert f"misfit {100 * misfit:.2g} %" in {row[0]: row[2] for row in described.sections["flow"]}["table"]
    drawn = described.sections["coefficients of table"]
    assert drawn[-1][0] == "warning"
    bump = next(row for row in drawn if row[0] == "U/(f D) 20")
    assert bump[2].index("o") > bump[2].index("+")  # the data lie above the fit
    outcome = gb.run(given, output=tmp_path / "run")
    assert outcome.exit_status == 0
    assert sum("misses measured coefficients" in one for one in outcome.summary["warnings"]) == 1
    kept = outcome.summary["scene"]["feedbacks"][0]["coefficients"]
    assert kept["misfit"] == pytest.approx(misfit, rel=1e-3)
    assert kept["measured"]["c"]["real"] == pytest.approx(c.real)
    line = np.interp(reduced, kept["fit"]["reduced_velocity"], kept["fit"]["c"]["real"])
    assert line == pytest.approx((c + least).real, abs=2e-2)
    assert tmp_path / "run" / "figures" / "coefficients_table.png" in gb.plot(tmp_path / "run")
    section = flow_section(outcome.summary, "gapbeam report run")
    assert section is not None
    chart = next(block for block in section.blocks if isinstance(block, Chart))
    assert [curve.name for curve in chart.curves][:2] == ["real part, measured", "real part, fit"]
    given["feedback"][0]["tolerance"] = 0.5
    assert gb.check(given).sections["coefficients of table"][-1][0] != "warning"


def test_two_phase_damping_has_a_source(tmp_path: Path) -> None:
    """Each mode of a tube decays by exp(-zeta w t) of the sum; Connors takes 2 pi times it; the source is shown."""
    given = tables(tmp_path)
    given = {key: given[key] for key in ("structure", "point", "joint", "feedback", "load", "time")}
    given["structure"], given["feedback"] = given["structure"][:1], given["feedback"][5:]
    dry = gb.eigenvalues(gb.scene(given))
    assert np.allclose(dry.real, -0.01 * np.abs(dry))
    given["structure"][0]["two_phase"] = {"ratio": 0.03, "source": "loop test 7, void fraction 0.6"}
    del given["feedback"][0]["decrement"]
    scene, described = gb.scene(given), gb.check(given)
    wet = gb.eigenvalues(scene)
    assert np.allclose(wet.real, -0.04 * np.abs(wet))
    assert (
        "tube",
        "two-phase damping 0.03 beside 0.01",
        "source: loop test 7, void fraction 0.6",
    ) in described.sections["structures"]
    first = sqrt(scene.squares[0]) / (2.0 * pi)
    critical = 3.0 * first * 0.019 * sqrt(0.8 * 2 * pi * 0.04 / (1000.0 * 0.019**2))
    assert next(row for row in described.sections["flow"] if "Connors" in row[0])[1].startswith(f"{critical:.4g} m/s")
    outcome = gb.run(given, output=tmp_path / "run")
    assert outcome.summary["sources"] == {"tube: two-phase damping 0.03 beside 0.01": "loop test 7, void fraction 0.6"}
    section = scene_table(outcome.summary)
    assert section is not None
    table = section.blocks[-1]
    assert isinstance(table, TableBlock)
    assert table.rows[0][1] == "loop test 7, void fraction 0.6"


def test_a_tube_in_two_planes_has_each_frequency_twice() -> None:
    """Frequencies of a pinned tube with added mass: (n pi / L)^2 sqrt(E I / (m + m_a)), slender, in both planes."""
    model = {"type": "beam", "length": 4.0, "thickness": 0.019, "section": {"type": "tube", "wall": 1.1e-3},
             "material": dict(STEEL), "added_mass": 0.3, "motions": 2}  # fmt: skip
    scene = gb.scene(
        {
            "structure": [{"name": "tube", "model": model}],
            "point": [{"name": "mid", "structure": "tube", "at": 2.0}],
            "joint": [{"type": "pinned", "structure": "tube", "at": x} for x in (0.0, 4.0)],
            "time": {"step": 1e-4, "end": 0.1},
        }
    )
    area, second = pi / 4 * (0.019**2 - 0.0168**2), pi / 64 * (0.019**4 - 0.0168**4)
    exact = [(n * pi / 4.0) ** 2 * sqrt(2.0e11 * second / (7850.0 * area + 0.3)) for n in (1, 1, 2, 2)]
    assert np.sqrt(scene.squares[:4]) == pytest.approx(exact, rel=1e-3)
    assert len(scene.point("mid").rows) == 2
    tube = scene.structures[0]
    pattern = np.split(gb.weight(tube, -9.81).pattern_on(tube), 2)
    assert np.any(pattern[0])
    assert not np.any(pattern[1])


put = partial(slips.put, "feedback")


def coefficients(text: str) -> Change:

    def change(_: Tables, folder: Path) -> None:
        (folder / "c.csv").write_text(text)

    return change


STEADY, MEMORY, TABLE, LAG, BRAKE, DESIGN = range(6)
UNSEEN = {"A": [[1.0, 0.0], [0.0, -1.0]], "B": [[1.0, 1.0], [1.0, 1.0]], "C": [[0.0, 1.0]]}
SLIPS: dict[str, tuple[Change, str, str]] = {
    "unknown type": (put(STEADY, "type", value="steady"), "steady.*type", "quasi-steady"),
    "no velocity": (put(STEADY, "velocity", value=None), "steady.*velocity", "missing"),
    "negative density": (put(MEMORY, "density", value=-1.0), "memory.*density", "greater than 0"),
    "no diameter": (put(TABLE, "diameter", value=0.0), "table.*diameter", "greater than 0"),
    "neither span nor point": (put(STEADY, "span", value=None), "steady.*span", "one of them"),
    "span and point": (put(STEADY, "point", value="tube.mid"), "steady.*span", "both of span and point"),
    "an unknown tube": (put(STEADY, "span", "structure", value="tub"), "steady.*structure", "did you mean"),
    "a span of a mass": (put(STEADY, "span", "structure", value="box"), "steady.*structure", "box.at"),
    "beyond the end": (put(MEMORY, "span", "to", value=1.5), "memory.*to", "at most 1 m"),
    "no length": (put(MEMORY, "span", "from", value=0.8), "memory.*from", "less than 0.75"),
    "points of a beam": (put(MEMORY, "span", "points", value=["mid", "end"]), "memory.*points", "from and to"),
    "no points of modes": (put(TABLE, "span", "points", value=None), "table.*points", "missing"),
    "an unknown point": (put(TABLE, "span", "points", value=["s0", "s1", "s2", "s3", "s9"]), "table.*", "s9"),
    "too few places": (put(TABLE, "span", "at", value=[0.0, 0.1]), "table.*at", "a place for each point"),
    "places in disorder": (put(TABLE, "span", "at", value=[0.0, 0.2, 0.1, 0.3, 0.4]), "table.*at", "one after the"),
    "from of modes": (put(TABLE, "span", "from", value=0.1), "table.*from", "leave from out"),
    "a short profile": (put(STEADY, "span", "velocity", value=[[0.0, 1.0], [0.5, 1.0]]), "steady.*velocity",
                        "covers the span"),
    "a profile in disorder": (put(STEADY, "span", "velocity", value=[[0.0, 1.0], [2.0, 1.0], [1.0, 1.0]]),
                              "steady.*velocity", "one after the other"),
    "a profile of 0": (put(STEADY, "span", "density", value=[[0.0, 0.0], [1.0, 1.0]]), "steady.*density", "above 0"),
    "two motions at points of one": (put(STEADY, "slope", value=[[0.0, 1.0], [1.0, 0.0]]), "steady.*slope",
                                     "1 motion"),
    "too many modes": (put(STEADY, "modes", value=500), "steady.*modes", "1 to 4[02]"),
    "modes at a point": (put(LAG, "modes", value=2), "lag.*modes", "unknown"),
    "a delay longer than the run": (put(STEADY, "delay", value=50.0), "steady.*delay", "longer than the run"),
    "a delay of too many waves": (put(STEADY, "frequency", value=5e4), "steady.*frequency",
                                  "error of .* with 12[^$]*expected: at most 0.01[^$]*try: +give a lower `frequency`"),
    "a tolerance of 1": (put(STEADY, "tolerance", value=1.0), "steady.*tolerance", "less than 1"),
    "too few rates": (put(MEMORY, "amplitudes", value=[0.3, 0.2]), "memory.*rates", "each of 2 amplitudes"),
    "a rate of 0": (put(MEMORY, "rates", value=[0.0]), "memory.*rates", "greater than 0"),
    "damping of two motions": (put(MEMORY, "damping", value=[[1.0, 0.0], [0.0, 1.0]]), "memory.*damping",
                               "the shape of stiffness"),
    "no file": (put(TABLE, "file", value="none.csv"), "table.*file", "no file"),
    "two columns": (coefficients("1.0,2.0\n2.0,3.0\n"), "table.*file", "3 or 9 columns"),
    "a column missing in a row": (coefficients("1,2,3\n2,1\n3,1,1\n4,1,1\n"), "table.*file", "2 numbers in line 2"),
    "words in the table": (coefficients("U,re,im\n1.0,two,3.0\n2.0,1.0,1.0\n"), "table.*file", "in line 2[^$]*finite"),
    "a hole in the table": (coefficients("1,2,3\n2,1,\n3,1,1\n4,1,1\n"), "table.*file", "in line 2[^$]*finite"),
    "not a number": (coefficients("1,2,3\n2,1,1\n3,nan,1\n4,1,1\n"), "table.*file", "in line 3[^$]*finite"),
    "an empty table": (coefficients("U,re,im\n"), "table.*file", "0 rows for 2 states"),
    "one velocity twice": (coefficients("3,1,0\n3,2,0\n9,1,0\n10,1,0\n"), "table.*file", "3 in line 2 after 3 in"),
    "velocities in disorder": (coefficients("3,1,0\n9,2,0\n4,1,0\n5,1,0\n"), "table.*file", "4 in line 3 after 9 in"),
    "a velocity of 0": (coefficients("0,1,0\n3,2,0\n9,1,0\n10,1,0\n"), "table.*file", "0 in line 1[^$]*above 0"),
    "few rows": (coefficients("3,1,0\n4,2,0\n9,1,0\n"), "table.*file", "3 rows for 2 states[^$]*4 or more"),
    "more states than rows": (put(TABLE, "states", value=12), "table.*file", "fewer states"),
    "a misfit of everything": (put(TABLE, "tolerance", value=1.0), "table.*tolerance", "less than 1"),
    "outside of the table": (put(TABLE, "frequencies", value=[2.0]), "table.*velocity", "table, 1 to 40"),
    "rows of two lengths": (put(LAG, "steady", value=[[1.0, 2.0], [3.0]]), "lag.*steady", "1 and 2 numbers"),
    "not square": (put(LAG, "steady", value=[[1.0, 2.0]]), "lag.*steady", "square matrix"),
    "two matrices for a lag": (put(LAG, "matrices", value=[[[1.0]], [[2.0]]]), "lag.*matrices", "1 matrices"),
    "another size of damping": (put(LAG, "damping", value=[[1.0, 0.0], [0.0, 1.0]]), "lag.*damping", "shape of steady"),
    "matrices of two motions": (lambda given, _: given["feedback"][LAG].update(
        steady=np.eye(2).tolist(), damping=np.eye(2).tolist(), matrices=[np.eye(2).tolist()]), "lag.*steady",
                                "points of 1 motion"),
    "an unknown sensor": (put(BRAKE, "sense", value=["box.tip"]), "brake.*sense", "box.at"),
    "B of another size": (put(BRAKE, "B", value=[[1.0]]), "brake.*B", r"expected: \(1, 2\)"),
    "C of another size": (put(BRAKE, "C", value=[[1.0, 2.0]]), "brake.*C", r"expected: \(1, 1\)"),
    "D of another size": (put(BRAKE, "D", value=[[1.0]]), "brake.*D", r"expected: \(1, 2\)"),
    "growth that no output shows": (lambda given, _: given["feedback"][BRAKE].update(UNSEEN), "brake.*A",
                                    r"grows as exp\(1 t\) and no output[^$]*try: +remove that state"),
    "Connors without span": (put(DESIGN, "span", value=None), "design.*span", "no such table"),
    "a negative decrement": (put(DESIGN, "decrement", value=-0.1), "design.*decrement", "greater than 0"),
    "Connors without damping": (lambda given, _: (given["feedback"][DESIGN].pop("decrement"),
                                                  given["structure"][0].pop("ratio")), "design.*decrement",
                                "no damping ratio"),
    "no source of two-phase damping": (lambda given, _: given["structure"][0].update(two_phase={"ratio": 0.02}),
                                       "tube.*source", "missing"),
    "two-phase damping of a mass": (lambda given, _: given["structure"][2].update(
        two_phase={"ratio": 0.02, "source": "test"}), "box.*two_phase", "leave two_phase out"),
    "damping of more than 1": (lambda given, _: given["structure"][0].update(
        two_phase={"ratio": 0.995, "source": "test"}), "tube.*ratio", "below 1"),
    "two names": (put(MEMORY, "name", value="steady"), "steady.*name", "different names"),
    "an unknown key": (put(STEADY, "lag", value=1.0), "steady.*lag", "unknown|no such"),
    "a rectangle in two planes": (lambda given, _: given["structure"][0]["model"].update(
        motions=2, section="rectangle"), "tube.*motions", "round or tube"),
    "a velocity with fluid": (lambda given, _: given["structure"][0].update(velocity=1.0), "tube.*velocity",
                              "moves a fluid"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_are_refused_by_their_key(tmp_path: Path, slip: str) -> None:
    """Status 2, at the key that is wrong, in words that name it."""
    given = tables(tmp_path)
    check_slip(given, SLIPS[slip], tmp_path)
