"""The command `gapbeam atlas` of files of structures: which points it starts from, and where it resumes when killed."""

from __future__ import annotations

import json
from math import hypot, pi
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq

from gapbeam.commands.study_choice import atlas
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.atlas import run_atlas
from tests.shared.command import PROJECT

FLUTTER = PROJECT / "cases" / "scenes" / "freeplay-flutter.toml"


def test_random_loads_have_no_atlas(tmp_path: Path) -> None:
    """Refused by their names, with what to do."""
    noise = '[[load]]\ntype = "random"\nname = "eddies"\npoint = "wing.plunge"\n'
    noise += 'spectrum = { type = "white", density = 1e-6, high = 5.0 }\n'
    path = tmp_path / "noise.toml"
    path.write_text(FLUTTER.read_text().replace('"flutter-', f'"{FLUTTER.parent}/flutter-') + noise)
    with pytest.raises(UserError, match=r"random load eddies, under which no motion repeats[^$]*`gapbeam run`"):
        repeating_scene(path, [])


def test_limit_cycles_are_not_followed(tmp_path: Path) -> None:
    """Refused before anything is searched: the option did nothing, without a word."""
    options = {"settle": 10, "rounds": 1, "orders": 1, "reach": 2.0, "seed": 0, "follow": True}
    with pytest.raises(UserError, match="leave out --follow"):
        atlas(FLUTTER, ["feedback.air.velocity=3.6,4.0"], None, 1, output=tmp_path / "found", **options)


@pytest.mark.slow(minutes=0.4)
def test_a_killed_atlas_of_a_flow_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed as its picture is drawn: called again it searches no more, and comes to the same table to the bit."""
    search, draw, searched, dead = run_atlas.cycle_atlas, run_atlas.draw_cycles, list[Any](), True

    def counted(scene: Any, *others: Any) -> Any:
        searched.append(scene)
        return search(scene, *others)

    def killed(*parts: Any) -> Any:
        if dead:
            raise KeyboardInterrupt
        return draw(*parts)

    monkeypatch.setattr(run_atlas, "cycle_atlas", counted)
    monkeypatch.setattr(run_atlas, "draw_cycles", killed)

    def found() -> str:
        options = {"settle": 10, "rounds": 1, "orders": 1, "reach": 2.0, "seed": 0}
        atlas(FLUTTER, ["feedback.air.velocity=3.6"], None, 1, output=tmp_path / "found", **options)
        return (tmp_path / "found" / "atlas.json").read_text()

    with pytest.raises(KeyboardInterrupt):
        found()
    before, dead = (tmp_path / "found" / "atlas.json").read_text(), False
    assert "period" in before
    assert found() == before
    assert len(searched) == 1
    assert not (tmp_path / "found" / "points.jsonl").exists()


OPTIONS = {"settle": 40, "rounds": 1, "orders": 2, "reach": 2.0, "seed": 0}


@pytest.mark.parametrize("scale", [1e-6, 1.0])
@pytest.mark.parametrize("keys", [[], ["pair.ring.region.clearance=3e-5,5e-5"]])
def test_a_rotor_whirls_in_a_round_hole_at_its_radius(keys: list[str], scale: float, tmp_path: Path) -> None:
    """A point of two motions: of a force that turns, m r'' + c r' + K (r - gap) = F gives the radius."""
    m, c, K, gap, F, f = 0.4 * scale, 80.0 * scale, 4e6 * scale, 4e-5, 60.0 * scale, 100.0
    loads = "".join(
        f'[[load]]\ntype = "harmonic_force"\nname = "{name}"\npoint = "rotor.at"\namplitude = {F}\nfrequency = {f}\n'
        f"phase = {phase}\ndirection = {way}\n"
        for name, phase, way in (("along", 0.0, [1.0, 0.0]), ("across", -90.0, [0.0, 1.0]))
    )
    law = f'{{ type = "kelvin-voigt", stiffness = {K} }}'
    path = tmp_path / "rotor.toml"
    path.write_text(f"""
structure = [{{ name = "rotor", model = {{ type = "mass", mass = {m}, motions = 2, damping = {c} }} }}]
pair = [{{ name = "ring", between = ["rotor.at"], region = {{ type = "disc", clearance = {gap} }}, law = {law} }}]
time = {{ end = 0.5, step = 1e-5 }}
{loads}""")
    w = 2.0 * pi * f
    atlas(path, keys[:1], None, 4, output=tmp_path / "found", **OPTIONS)
    for point in json.loads((tmp_path / "found" / "atlas.json").read_text()):
        play = point["values"].get("pair.ring.region.clearance", gap)
        radius = brentq(lambda r, play=play: hypot(K * (r - play) - m * w**2 * r, c * w * r) - F, play, 2.0 * play)
        (found,) = point["responses"]
        assert set(found["peak"]) == {"at 1", "at 2"}
        assert all(abs(one / radius - 1.0) < 1e-3 for one in found["peak"].values())


@pytest.mark.parametrize("places", [(0.0, 0.3), (0.0, 0.15, 0.3), (0.0, 0.05, 0.1, 0.3)])
def test_points_of_a_rigid_bar_that_follow_each_other_do_not_stop_an_atlas(
    places: tuple[float, ...], tmp_path: Path
) -> None:
    points = "".join(f'[[point]]\nname = "p{i}"\nstructure = "bar"\nat = {x}\n' for i, x in enumerate(places))
    springs = "".join(
        f'[[joint]]\ntype = "elastic"\nname = "s{i}"\nbetween = ["bar.p{i}"]\nstiffness = 2e4\ndamping = 9.0\n'
        for i in (0, len(places) - 1)
    )
    steel = "{ young_modulus = 2e11, poisson_ratio = 0.3, density = 7850.0 }"
    law = '{ type = "kelvin-voigt", stiffness = 1e5, damping = 20.0 }'
    path = tmp_path / "bar.toml"
    path.write_text(f"""
structure = [{{ name = "bar", model = {{ type = "rigid", length = 0.3, thickness = 0.01, material = {steel} }} }}]
pair = [{{ name = "stop", between = ["bar.p0"], region = {{ type = "half-plane", clearance = 2e-4 }}, law = {law} }}]
load = [{{ type = "harmonic_force", point = "bar.p0", amplitude = 10.0, frequency = 60.0 }}]
time = {{ end = 0.5, step = 4e-5 }}
{points}{springs}""")
    atlas(path, [], None, 4, output=tmp_path / "found", **OPTIONS)
    (point,) = json.loads((tmp_path / "found" / "atlas.json").read_text())
    assert [one["order"] for one in point["responses"]] == [1]
    assert set(point["responses"][0]["peak"]) == {f"p{i}" for i in range(len(places))}
