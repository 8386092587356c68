"""Units of rotations and moments in figures of runs: read back as angles, they agree with the lever arm."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import gapbeam as gb
from gapbeam.commands.study_choice import atlas
from gapbeam.postprocess.figures.curve_figures import draw_impacts
from gapbeam.postprocess.figures.motion_figures import draw_contact
from gapbeam.postprocess.report.sections.statistics_section import impacts_section, peak_rows
from gapbeam.postprocess.results.columns_of_run import impacts_of
from gapbeam.postprocess.signals.cycle_counts import impact_data, impact_rows
from gapbeam.solver.kernel.kernel_data import kernel_data, model_description
from gapbeam.studies.atlas import run_atlas
from gapbeam.studies.uncertain.member_responses import figure_units

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}


def hinged(about: Any = None, direction: Any = None) -> dict[str, Any]:
    """Return the tables of a bar hinged at x = 0, with play there about an axis or along a direction at its end."""
    way = {"direction": direction} if about is None else {"about": about}
    return {
        "structure": [{"name": "bar", "reduce": {"modes": 8}, "ratio": 0.01,
                       "model": {"type": "frame", "route": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "thickness": 0.05,
                                 "material": STEEL}}],
        "joint": [{"type": "pinned", "structure": "bar", "at": 0.0}]
        + [{"type": "elastic", "between": [f"bar.{name}"], "stiffness": 1e6} for name in ("twist", "yaw")],
        "point": [
            {"name": "hinge", "structure": "bar", "at": 0.0 if direction is None else 1.0, **way},
            {"name": "tip", "structure": "bar", "at": 1.0, "direction": [0.0, 0.0, 1.0]},
            {"name": "twist", "structure": "bar", "at": 0.0, "about": [1.0, 0.0, 0.0]},
            {"name": "yaw", "structure": "bar", "at": 0.0, "about": [0.0, 0.0, 1.0]},
        ],
        "contact": {"law": {"type": "kelvin-voigt", "stiffness": 1e4, "damping": 1.0}},
        "pair": [{"name": "play", "between": ["bar.hinge"], "region": {"type": "slot", "clearance": 2e-3}}],
        "load": [{"type": "harmonic_force", "name": "push", "point": "bar.tip", "amplitude": 0.5, "frequency": 2.0}],
        "figure": [{"name": "own", "quantity": "contact_force", "place": "play", "magnitude": True},
                   {"name": "turn", "quantity": "displacement", "place": "hinge", "magnitude": True}],
        "time": {"step": 5e-4, "end": 0.5},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("given", "units"),
    [
        ({"about": [0.0, 1.0, 0.0]}, ("rad", "rad/s^2", "N m", "N m s")),
        ({"about": [0.0, 3.0, 0.1]}, ("rad", "rad/s^2", "N m", "N m s")),
        ({"direction": [0.0, 0.0, 1.0]}, ("m", "m/s^2", "N", "N s")),
    ],
)
def test_rotations_have_radians_and_moments_newton_meters(
    given: Any, units: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the point about an axis and the pair there, also as own figures; not of points that move."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    outcome = gb.run(hinged(**given), output=tmp_path / "run")
    found = {one["name"]: one["unit"] for one in outcome.figures}
    names = ("peak-to-peak displacement", "peak-to-peak smoothed acceleration")
    assert tuple(found[f"hinge {name}"] for name in names) == units[:2]
    assert {unit for name, unit in found.items() if name.startswith("play") and name.endswith("force")} == {units[2]}
    assert found["play impulse"] == units[3]
    assert found["tip peak-to-peak displacement"] == "m"
    assert found["yaw peak-to-peak displacement"] == "rad"
    own = outcome.summary["figures"]
    assert [own[name]["unit"] for name in ("own", "turn")] == [units[2], units[0]]
    turning = outcome.summary["scene"]["turning"]
    assert ("hinge" in turning) is ("play" in turning) is ("about" in given)
    if "about" in given:  # a stiff bar: its tip moves by the angle times 1 m
        ratio = abs(outcome.history.displacement.sel(probe="tip").values).max() / own["turn"]["value"]
        assert ratio == pytest.approx(1.0, rel=0.02)


MOVED = {"displacement": "m", "velocity": "m/s", "contact_force": "N", "impulse": "N s", "penetration": "m"}
TURNED = {"displacement": "rad", "velocity": "rad/s", "contact_force": "N m", "impulse": "N m s", "penetration": "rad"}


@pytest.mark.parametrize("given", [{"about": [0.0, 1.0, 0.0]}, {"direction": [0.0, 0.0, 1.0]}])
@pytest.mark.parametrize("records", [(), tuple(MOVED)])
def test_columns_and_pictures_have_the_units_of_their_places(
    given: Any, records: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also beside a stop and points that move."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    stop = {"name": "stop", "between": ["bar.tip"], "region": {"type": "half-plane", "clearance": 1.5e-3}}
    tables = hinged(**given)
    outcome = gb.run(tables | {"pair": [*tables["pair"], stop]}, output=tmp_path / "run")
    heads = gb.export(outcome, tmp_path / "history.csv", records=records).read_text().splitlines()[0].split(",")
    turning = {"twist", "yaw", *(("hinge", "play") if "about" in given else ())}
    for place in ("hinge", "tip", "twist", "yaw", "play", "stop"):
        units = TURNED if place in turning else MOVED
        for record in list(units)[2:] if place in ("play", "stop") else list(units)[:2]:
            assert f"{record} {place}{'' if place in ('play', 'stop') else ' y'} ({units[record]})" in heads
    gb.plot(outcome, psd=["displacement"], rainflow=["contact_force"])
    force = "N m or N" if "play" in turning else "N"
    assert (tmp_path / "run/figures/cycles_contact_force.csv").read_text().startswith(f"column,range ({force})")
    labels = [panel.get_ylabel() for panel in draw_contact(outcome.history, 2.0).axes]
    assert f"contact force ({force})" in labels
    both = re.compile(r"penetration \((\w*)rad or \1m\)")
    assert any(map(both.fullmatch, labels)) is ("play" in turning)
    peaks = {words.removeprefix("largest displacement of "): unit for words, _, unit in peak_rows(outcome.history)}
    assert peaks["tip"] == "mm"
    assert peaks["yaw"].removeprefix("µ") == "rad"


@pytest.mark.parametrize("places", [("play",), ("stop",), ("play", "stop")])
def test_impacts_have_the_units_of_their_faces(
    places: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The speed of the fastest impact, read back with its unit, is the closing speed in the history."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    tables = hinged(about=[0.0, 1.0, 0.0])
    stop = {"name": "stop", "between": ["bar.tip"], "region": {"type": "half-plane", "clearance": 0.5e-3}}
    pairs = [one for one in [*tables["pair"], stop] if one["name"] in places]
    case = tables | {"pair": pairs, "figure": []}
    outcome = gb.run(case, output=tmp_path / "run")
    described = str(gb.check(case))
    impacts, turning = impacts_of(tmp_path / "run"), {"play"}
    history = outcome.history
    section = impacts_section(impacts, 0.5, turning=turning)
    assert section is not None
    cells = {row[:2]: row[-1] for row in section.blocks[1].rows}
    drawn = [panel.get_xlabel() for panel in draw_impacts(impacts, turning).axes]
    words, data = "\n".join(impact_rows(impacts, 0.5, turning)), impact_data(impacts, 0.5)
    speeds, pulses = [], []
    for face in places:
        deep = history.penetration.sel(face=face).values
        rates = [(b - a) / 5e-4 for a, b in pairwise(deep) if a <= 0.0 < b]
        unit, factor, pulse = ("rad/s", 1.0, "mN m s") if face == "play" else ("mm/s", 1e3, "mN s")
        assert cells[face, f"approach speed ({unit})"] == pytest.approx(factor * max(rates), rel=0.1)
        assert (face, f"impulse ({pulse})") in cells
        assert f"{face}: 0 {pulse.removesuffix(' s').removeprefix('m')} (open)" in described
        assert data[face]["approach_speed"]["largest"] == pytest.approx(max(rates), rel=0.1)
        assert f"approach speed, {unit}" in words
        speeds.append(unit)
        pulses.append(pulse)
    assert drawn[:2] == [f"approach speed ({' or '.join(speeds)})", f"impulse ({' or '.join(pulses)})"]
    columns = gb.export(outcome, tmp_path / "impacts.csv", table="impacts").read_text().splitlines()[0]
    assert f"approach_speed ({' or '.join(unit.replace('mm', 'm') for unit in speeds)})" in columns
    assert f"impulse ({' or '.join(unit.replace('mN', 'N') for unit in pulses)})" in columns


def test_statistics_have_the_units_of_their_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also beside points that move: the tip is 1 m from the hinge, so that both have the same rms."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    tables = hinged(about=[0.0, 1.0, 0.0])
    noise = {"type": "random", "name": "noise", "quantity": "force", "point": "bar.tip", "seed": 1,
             "spectrum": {"type": "white", "density": 0.02, "low": 0.5, "high": 10.0}}  # fmt: skip
    own = [{"name": "own", "quantity": "displacement", "place": "hinge", "statistic": "rms"}]
    outcome = gb.run(
        tables | {"load": [noise], "figure": own, "time": {"step": 1e-3, "end": 40.0}}, output=tmp_path / "run"
    )
    found = {one["name"]: one for one in outcome.summary["statistics"]["figures"]}
    of_play = {"mean_force": "N m", "rms_force": "N m", "impact_impulse": "N m s", "approach_speed": "rad/s"}
    assert {name: found[f"face.play.{name}"]["unit"] for name in of_play} == of_play
    assert [found[f"probe.{name}.rms"]["unit"] for name in ("hinge", "yaw", "tip")] == ["rad", "rad", "m"]
    assert found["probe.hinge.acceleration_rms"]["unit"] == "rad/s^2"
    assert found["own"]["unit"] == "rad"
    assert found["probe.hinge.rms"]["value"] == pytest.approx(found["probe.tip.rms"]["value"], rel=0.02)


@pytest.mark.parametrize("given", [{"about": [0.0, 1.0, 0.0]}, {"direction": [0.0, 0.0, 1.0]}])
def test_studies_have_the_units_of_their_places(given: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sweeps with figures of one's own, atlases, and figures of uncertain values."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    tables, path, drawn = hinged(**given), tmp_path / "bar.toml", list[Any]()
    tables["structure"][0]["ratio"] = 0.05
    tables["point"], tables["joint"] = tables["point"][:1], [{"type": "clamped", "structure": "bar", "at": 0.0}]
    tables["point"][0]["at"] = 1.0
    tables["load"][0] |= {"point": "bar.hinge", "amplitude": 1000.0, "frequency": 20.0}
    path.write_text("\n".join(f"{name} = {inline(value)}" for name, value in tables.items()))
    angle, moment = ("rad", "N m") if "about" in given else ("m", "N")
    key = "pair.play.region.clearance"
    gb.sweep(path, {key: [1e-3, 2e-3]}, output=tmp_path / "sweep", workers=1)
    heads = (tmp_path / "sweep/sweep.csv").read_text().splitlines()[0].split(",")
    assert {f"turn ({angle})", f"own ({moment})", f"hinge peak-to-peak displacement ({angle})"} <= set(heads)
    monkeypatch.setattr(run_atlas, "write_figure", lambda picture, _: drawn.append(picture))
    options: dict[str, Any] = {"settle": 20, "rounds": 1, "orders": 1, "reach": 2.0, "seed": 0}
    atlas(path, [f"{key}=1e-3,2e-3"], None, 2, output=tmp_path / "atlas", **options)
    heads = (tmp_path / "atlas/atlas.csv").read_text().splitlines()[0].split(",")
    assert {f"force ({moment})", f"hinge: peak ({angle})"} <= set(heads)
    assert drawn[0].axes[0].get_ylabel() == f"hinge, each period ({angle})"
    units = figure_units(gb.scene(tables), [gb.figure("turn", "displacement", "hinge", statistic="maximum")])
    wanted = {"turn": angle, "peak/hinge": angle, "rms/hinge": angle, "mean_force/play": moment, "closed/play": ""}
    assert {name: units[name] for name in wanted} == wanted


@pytest.mark.parametrize("given", [{"about": [0.0, 1.0, 0.0]}, {"direction": [0.0, 0.0, 1.0]}])
def test_units_for_other_simulators_have_the_units_of_their_places(given: Any) -> None:
    """Points, faces, and loads: rad = 1 and N m = kg m^2 s^-2 in the base units of FMI, also beside others."""
    tables = hinged(**given)
    tables["joint"] = tables["joint"][:1]
    tables["load"] += [tables["load"][0] | {"name": "twist", "point": "bar.hinge"}]
    data = kernel_data(gb.scene(tables), 1e-4)
    found = {one.name: one.unit for one in data.variables}
    turns = "about" in given
    wanted = {
        "hinge.displacement": ("m", "rad"), "hinge.velocity": ("m/s", "rad/s"), "hinge.force": ("N", "N m"),
        "hinge.force.slope": ("N/s", "N m/s"), "play.clearance": ("m", "rad"), "play.stiffness": ("N/m", "N m/rad"),
        "play.force": ("N", "N m"), "twist.amplitude": ("N", "N m"), "twist.value": ("N", "N m"),
        "tip.displacement": ("m", "m"), "push.amplitude": ("N", "N"), "yaw.displacement": ("rad", "rad"),
    }  # fmt: skip
    assert {name: found[name] for name in wanted} == {name: units[turns] for name, units in wanted.items()}
    text = model_description(data, "bar", "token").decode()
    for unit, base in {"rad": 'rad="1"', "N m": 'kg="1" m="2" s="-2"', "rad/s": 'rad="1" s="-1"'}.items():
        assert f'<Unit name="{unit}">\n      <BaseUnit {base} />' in text
    assert set(found.values()) <= {"", *re.findall('<Unit name="(.*?)">', text)}


def inline(value: Any) -> str:
    """Return a value as inline TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {inline(one)}" for name, one in value.items()) + "}"
    return f"[{', '.join(map(inline, value))}]" if isinstance(value, list) else json.dumps(value)
