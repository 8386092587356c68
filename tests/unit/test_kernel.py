"""The C kernel against the march in Python and a closed form, and units against the calls and rules of FMI 3.0."""

from __future__ import annotations

import base64
import ctypes
import hashlib
import json
import re
import shutil
import subprocess
from importlib.resources import files
from math import exp
from pathlib import Path

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.interface.case_fmu import live_model
from gapbeam.postprocess.report.blocks import LiveModel, Report, ReportSection
from gapbeam.postprocess.report.html_page import html_of
from gapbeam.solver.kernel.kernel_data import kernel_data
from tests.shared.kernel_calls import MarchedBlock, Unit

H, STEPS = 2e-5, 3000
KERNEL = files("gapbeam.solver.kernel")


def rattling(exponent: float = 0.0, slot: bool = True, damper: float = 0.0) -> gb.Scene:
    """Return a pinned beam that strikes a support near its pin and a stop at its end; full damping with a damper."""
    material, section = gb.material(2e11, 7800.0), gb.section("rectangle", thickness=0.012, width=0.02)
    places = {"pin": 0.0, "held": 0.05, "middle": 0.25, "tip": 0.5}
    beam = gb.beam(0.5, section, material, places, pinned=[0.0], modes=8, ratio=0.01, name="beam")
    if damper:
        row = beam["middle"].rows[0]
        C = (0.0 if beam.C is None else beam.C) + damper * np.outer(row, row)
        beam = gb.Structure(beam.M, beam.K, C, {one: beam[one].rows[0] for one in places}, name="beam")
    law = gb.HuntCrossley(1e9, 0.5, exponent) if exponent else gb.KelvinVoigt(stiffness=1e7, damping=50.0)
    region = gb.Slot(1e-4, 1e-5) if slot else gb.HalfPlane(5e-5, -1.0)
    contacts = [
        gb.Contact(beam["held"], region, law, name="left", offset=1e-6),
        gb.Contact(beam["tip"], gb.HalfPlane(1e-3), law, name="stop"),
    ]
    shaker = gb.Force(beam["middle"], gb.sine, amplitude=40.0, frequency=33.0, phase=20.0, ramp=0.01, name="shaker")
    lift = gb.Force(beam["tip"], 2.0, name="lift")
    return gb.Scene(beam, contacts=contacts, loads=[shaker, lift])


def test_the_binaries_are_those_of_their_source() -> None:
    """`environment/build-kernel` puts the checksum of the source into both."""
    source = b"".join(KERNEL.joinpath(one).read_bytes() for one in ("kernel.c", "fmi3.c"))
    mark = f"source {hashlib.sha256(source).hexdigest()}".encode()
    for name in ("gapbeam.so", "kernel.wasm"):
        assert mark in KERNEL.joinpath("binaries", name).read_bytes(), f"{name}: run environment/build-kernel"


@pytest.mark.parametrize(("exponent", "slot", "damper"), [(0.0, True, 0.0), (1.5, False, 3.0)])
def test_the_kernel_marches_as_python_does(exponent: float, slot: bool, damper: float) -> None:
    """Displacements and forces of 3000 steps with impacts, and values that change at half of them."""
    scene = rattling(exponent, slot, damper)
    block = MarchedBlock(kernel_data(scene, H))
    whole = {
        "left.clearance": 2e-4 if slot else 1e-4,
        "left.stiffness": 2e7,
        "shaker.amplitude": 60.0,
        "shaker.frequency": 41.0,
    }
    first = gb.history(scene, H, H * STEPS)
    then = gb.history(scene.with_(whole), H, 2 * H * STEPS, first.last.state)
    name = "left" if slot else "stop"
    sign = -1.0  # the force on the support is that on the point, turned round
    for part in (first, then):
        moved, felt = part.displacement["tip"], sign * np.asarray(part.force[name])
        found = []
        for _ in range(STEPS):
            block.march(1)
            found.append((block["tip.displacement"], block[f"{name}.force"]))
        mine = np.array(found)
        assert np.count_nonzero(felt) > STEPS / 50
        assert np.abs(mine[:, 0] - moved).max() <= 1e-9 * np.abs(moved).max()
        assert np.abs(mine[:, 1] - felt).max() <= 1e-9 * np.abs(felt).max()
        for path, value in whole.items():
            block[path] = value
    assert block["tip.velocity"] == pytest.approx(then.last["tip"].velocity, rel=1e-8)


def test_restitution_of_hunt_crossley_is_the_closed_form() -> None:
    """Restitution e solves p (1 + e) = ln((1 + p) / (1 - p e)) with p = chi v0, whatever the mass and the spring."""
    body = gb.mass(2.0)
    for exponent in (1.0, 1.5, 3.5):
        contact = gb.Contact(body["at"], gb.HalfPlane(0.0), gb.HuntCrossley(1e6, 0.5, exponent), name="wall")
        scene = gb.Scene(body, contacts=[contact])
        start = scene.state(velocity={body: 1.0})
        block = MarchedBlock(kernel_data(scene, 1e-5, start))
        block.march(20000)
        e = -block["at.velocity"]
        assert block["wall.force"] == 0.0
        assert exp(0.5 * (1.0 + e)) * (1.0 - 0.5 * e) == pytest.approx(1.5, rel=2e-4)


def test_what_the_kernel_cannot_march_is_refused_by_name() -> None:
    """All of it in one message; step and inputs, too."""
    body, other, third = gb.mass(1.0, motions=2, name="body"), gb.mass(1.0, name="other"), gb.mass(1.0, name="third")
    law = gb.KelvinVoigt(stiffness=1e5)
    contacts = [
        gb.Contact(body["at"], gb.Disc(1e-4), law, friction=0.1, name="hole"),
        gb.Contact(
            other["at"], gb.Slot(1e-4), gb.Cubic(stiffness=1e5, scale=1e-3), wall=lambda t: 1e-5 * t, name="bumper"
        ),
        gb.Contact(other["at"], gb.Slot(1e-4), gb.HuntCrossley(1e5, 0.0, 1.7), name="odd"),
    ]
    joint = gb.Joint(other["at"], stiffness=10.0, name="spring")
    loads = [gb.Force(other["at"], lambda t: t, name="push")]
    strut = gb.Joint((other["at"], third["at"]), stiffness=10.0)
    brake = gb.Feedback(other["at"], other["at"], [], [], [], [[-1.0, 0.0]])
    scene = gb.Scene(body, other, third, contacts=contacts, loads=loads, joints=[joint, strut], feedbacks=[brake])
    with pytest.raises(gb.UserError) as refused:
        kernel_data(scene, H, inputs=["pull"])
    for words in (
        "contact hole: region Disc", "contact hole: friction", "contact bumper: law Cubic", "contact bumper: a wall",
        "contact odd: law HuntCrossley", "load push: a function of time", "joint spring", "input 'pull'",
        "joint at other.at and third.at", "feedback at other.at",
    ):  # fmt: skip
        assert words in str(refused.value)
    for wrong in (0.0, float("nan")):
        with pytest.raises(gb.UserError, match="expected a time above 0"):
            kernel_data(rattling(), wrong)


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Unit:
    """Return a unit whose shaker is an input."""
    folder = tmp_path_factory.mktemp("unit")
    path = gb.fmu(rattling(), folder / "beam.fmu", inputs=["shaker"], step=H, end=0.1)
    with pytest.raises(gb.UserError, match="is there already"):
        gb.fmu(rattling(), path, step=H)
    return Unit(path, folder / "unpacked")


def test_a_unit_follows_the_march_between_communication_points(unit: Unit) -> None:
    """Inputs that are straight from point to point are a table of the march; a step takes 7 of the kernel."""
    points, length = 200, 7 * H
    times = length * np.arange(points + 1)
    values = 40.0 * np.sin(2.0 * np.pi * 33.0 * times) + 0.1
    scene = rattling().with_({"shaker.value": 0.0})
    scene = gb.Scene(*scene.structures, contacts=scene.contacts, loads=[
        gb.Force(scene.structures[0]["middle"], (times, values), name="shaker"), scene.loads[1],
    ])  # fmt: skip
    expected = gb.history(scene, H, times[-1])
    unit.begin()
    found = []
    for k in range(points):
        unit["shaker.value"], unit["shaker.value.slope"] = values[k], (values[k + 1] - values[k]) / length
        assert unit.step(times[k], length) == 0, unit.said
        found.append(unit["tip.displacement"])
    moved = expected.displacement["tip"][6::7]
    assert np.abs(np.array(found) - moved).max() <= 1e-9 * np.abs(moved).max()
    assert unit["time"] == pytest.approx(times[-1])
    assert unit["tip.velocity"] == pytest.approx(expected.last["tip"].velocity, rel=1e-8)
    assert np.any(expected.force["left"] != 0.0)


def test_a_unit_refuses_what_it_cannot_do_and_keeps_its_state(unit: Unit) -> None:
    """Other communication steps and points, variables that are none; a kept state, and a reset."""
    assert unit.call("Reset") == 0
    unit.begin(0.5)
    assert unit["time"] == 0.5
    unit["tip.force"] = 1.0
    assert unit.step(0.5, 1.5 * H) == 3
    assert "expected a multiple of the step of the unit, 2e-05 s" in unit.said[-1]
    assert unit.step(0.5, 0.0) == unit.step(0.5, float("nan")) == 3
    assert unit.step(0.6, H) == 3
    assert "the unit is at 0.5 s" in unit.said[-1]
    assert unit.refuses("tip.displacement", 1.0)
    assert unit.refuses("tip.force", float("inf"))
    assert unit.call("GetInt32") == 3
    assert unit.step(0.5, 30 * H) == 0
    kept, before = ctypes.c_void_p(None), unit["tip.displacement"]
    assert unit.call("GetFMUState", ctypes.byref(kept)) == 0
    assert unit.step(0.5 + 30 * H, 10 * H) == 0
    after = unit["tip.displacement"]
    assert unit.call("SetFMUState", kept) == 0
    assert unit["tip.displacement"] == before != after
    assert unit.step(0.5 + 30 * H, 10 * H) == 0
    assert unit["tip.displacement"] == after
    assert unit.call("FreeFMUState", ctypes.byref(kept)) == 0
    assert unit.call("Reset") == 0
    assert unit["tip.displacement"] == 0.0


def test_the_description_keeps_the_rules_of_fmi(unit: Unit) -> None:
    """Order of elements, attributes, starts and structure of the FMI 3.0 schema and sections 2.4.7 and 2.4.8."""
    root = unit.description
    assert root.get("fmiVersion") == "3.0"
    order = [
        "CoSimulation",
        "UnitDefinitions",
        "LogCategories",
        "DefaultExperiment",
        "ModelVariables",
        "ModelStructure",
    ]
    assert [one.tag for one in root] == order
    variables = list(root.iter("Float64"))
    names, places = ([one.get(key) for one in variables] for key in ("name", "valueReference"))
    assert len(set(names)) == len(names)
    assert len(set(places)) == len(places)
    assert [one.get("name") for one in variables if one.get("causality") == "independent"] == ["time"]
    kinds = {"input": {"continuous", "discrete"}, "parameter": {"tunable"}, "output": {"continuous"}}
    units = {one.get("name") for one in root.iter("Unit")}
    of = {one.get("name"): one.get("unit") for one in variables}
    assert (of["lift.mean"], of["left.stiffness"], of["left.clearance"]) == ("N", "N/m", "m")
    for one in variables[1:]:
        role = str(one.get("causality"))
        assert one.get("variability") in kinds[role]
        assert (one.get("start") is None) == (role == "output")
        assert one.get("unit") is None or one.get("unit") in units
    outputs = [one.get("valueReference") for one in variables if one.get("causality") == "output"]
    for kind in ("Output", "InitialUnknown"):
        assert [one.get("valueReference") for one in root.iter(kind)] == outputs
    assert {"tip.force", "left.clearance", "left.stiffness", "lift.mean", "left.force"} <= set(names)
    assert "shaker.amplitude" not in names


def test_fmpy_accepts_and_simulates_a_unit(tmp_path: Path) -> None:
    """The validator of FMPy finds nothing, and its simulation is the march."""
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
    from fmpy.validation import validate_fmu

    scene = rattling()
    path = str(gb.fmu(scene, tmp_path / "beam.fmu", step=H, end=0.04))
    assert validate_fmu(path) == []
    found = fmpy.simulate_fmu(path, output_interval=10 * H, output=["tip.displacement"])
    moved = gb.history(scene, H, 0.04).displacement["tip"][9::10]
    assert np.abs(found["tip.displacement"][1:] - moved).max() <= 1e-9 * np.abs(moved).max()


def test_the_kernel_of_pages_marches_as_python_does(tmp_path: Path) -> None:
    """WebAssembly of the same source, in the system's Node.js or in Playwright's."""
    node = shutil.which("node")
    if node is None:
        driver = pytest.importorskip("playwright._impl._driver", reason="neither Node.js nor Playwright is installed")
        node = driver.compute_driver_executable()[0]
        if subprocess.run([node, "--version"], capture_output=True, check=False).returncode != 0:
            pytest.skip("Playwright's Node.js lacks a library of the system")
    scene = rattling()
    data = kernel_data(scene, H)
    (tmp_path / "block").write_bytes(data.block.astype("<f8").tobytes())
    place = next(one.place for one in data.variables if one.name == "tip.displacement")
    program = Path(__file__).parents[1] / "programs" / "kernel_in_node.mjs"
    wasm = str(KERNEL.joinpath("binaries", "kernel.wasm"))
    words = [node, str(program), wasm, str(tmp_path / "block"), str(data.size), str(STEPS), str(place)]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    moved = gb.history(scene, H, H * STEPS).displacement["tip"]
    assert np.abs(np.array(done.stdout.split(), dtype=float) - moved).max() <= 1e-9 * np.abs(moved).max()


def test_a_page_holds_the_kernel_and_the_block_of_its_scene() -> None:
    """Both are in the page to the byte, and its policy lets a browser compile the kernel, but fetch nothing."""
    data = kernel_data(rattling(), H)
    page = html_of(Report("A", "", [ReportSection("Try", "live", [LiveModel(data.as_json(), "A model.")])]))
    found = re.search(r'data-part="data">(.*?)</script>', page)
    assert found is not None
    held = json.loads(found.group(1))
    assert base64.b64decode(held["kernel"]) == KERNEL.joinpath("binaries", "kernel.wasm").read_bytes()
    assert base64.b64decode(held["block"]) == data.block.astype("<f8").tobytes()
    assert [one["place"] for one in held["variables"]] == [one.place for one in data.variables]
    assert "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'" in page


def test_runs_of_models_that_the_kernel_knows_have_a_live_model(tmp_path: Path) -> None:
    """A beam model has one with its sliders; a full model has none."""
    cases = Path(gb.__file__).parent / "cases"
    (tmp_path / "case.toml").write_text((cases / "exciter.toml").read_text())
    found = live_model(tmp_path)
    assert found is not None
    units = {one["name"]: one["unit"] for one in found["variables"]}
    assert {"base.clearance", "tip.displacement"} <= set(units)
    assert [units[one] for one in ("exciter.amplitude", "exciter.frequency", "gravity.mean")] == ["N", "Hz", "m/s2"]
    (tmp_path / "case.toml").write_text((cases / "demo.toml").read_text())
    assert live_model(tmp_path) is None
