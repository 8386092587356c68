"""Values of files of structures in another unit are asked about, for every kind of body; usual ones are not."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gapbeam as gb
from tests.shared.command import PROJECT

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
Tables = dict[str, Any]


def bodies() -> dict[str, Tables]:
    section = {"thickness": 0.02, "material": dict(STEEL)}
    return {
        "beam": {"type": "beam", "length": 0.5, **section},
        "rigid": {"type": "rigid", "length": 0.5, **section},
        "frame": {"type": "frame", "route": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.3, 0.0, 0.5]], **section},
    }


def file_of(kind: str, change: Callable[[Tables], None], play: float = 1e-3) -> Tables:
    model = bodies()[kind]
    change(model)
    spot: Tables = {"name": "tip", "structure": "body", "at": 0.2}
    if kind == "frame":
        spot["direction"] = [1.0, 0.0, 0.0]
    return {
        "structure": [{"name": "body", "model": model}],
        "point": [spot],
        "pair": [
            {
                "name": "gap", "between": ["body.tip"], "region": {"type": "slot", "clearance": play},
                "law": {"type": "kelvin-voigt", "stiffness": 1e6},
            }
        ],
        "time": {"step": 1e-4, "end": 0.01},
    }  # fmt: skip


def times(key: str, by: float) -> Callable[[Tables], None]:
    def change(model: Tables) -> None:
        owner = model if key in model else model["material"]
        value = owner.get(key)
        owner[key] = [[by * x for x in row] for row in value] if key == "route" else by * value

    return change


SLIPS: dict[str, tuple[str, Callable[[Tables], None], str]] = {
    "beam in mm": ("beam", times("length", 1e3), r"length = 500 is unusual.*is it in mm, 0\.5 m"),
    "bar in mm": ("rigid", times("length", 1e3), r"length = 500 is unusual.*is it in mm, 0\.5 m"),
    "route in mm": ("frame", times("route", 1e3), r"route, as length = 500 is unusual.*is it in mm, 0\.5 m"),
    "thickness in mm": ("beam", times("thickness", 1e3), r"thickness = 20 is unusual.*is it in mm, 0\.02 m"),
    "wall thickness of a frame in mm": ("frame", times("thickness", 1e3), "thickness = 20 is unusual"),
    "thick": ("rigid", times("thickness", 100.0), "thickness = 2 is more than the length, 0.5 m"),
    "GPa": ("beam", times("young_modulus", 1e-9), r"young_modulus = 210 is unusual.*is it in GPa, 2\.1e\+11 Pa"),
    "MPa": ("frame", times("young_modulus", 1e-6), "young_modulus = 210000 is less than any material.*in MPa"),
    "t/mm^3": ("rigid", times("density", 1e-12), r"density = 7\.85e-09 is unusual.*is it in t/mm\^3, 7850"),
    "g/cm^3": ("frame", times("density", 1e-3), r"density = 7\.85 is unusual.*is it in g/cm\^3, 7850"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_values_in_another_unit_are_asked_about(slip: str, caplog: pytest.LogCaptureFixture) -> None:
    kind, change, words = SLIPS[slip]
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(file_of(kind, change))
    assert any(re.search(words, one) for one in caplog.messages), caplog.messages
    assert all('[[structure]] number 1 (name "body")' in one for one in caplog.messages)


@pytest.mark.parametrize("kind", bodies())
def test_play_and_damping_in_another_unit_are_asked_about(kind: str, caplog: pytest.LogCaptureFixture) -> None:
    given = file_of(kind, lambda _: None, play=0.3)
    given["structure"][0]["ratio"] = 0.6
    if kind == "rigid":
        del given["structure"][0]["ratio"]
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(given)
    play = [
        one for one in caplog.messages if one.startswith('[[pair]] number 1 (name "gap") region clearance = 0.3 is')
    ]
    assert len(play) == 1
    assert "is it in mm, 0.0003 m" in play[0]
    assert ("0.6 of critical damping is unusual: is it in %, 0.006" in " ".join(caplog.messages)) == (kind != "rigid")


SCENES = sorted((PROJECT / "cases" / "scenes").glob("*.toml"))


@pytest.mark.parametrize("path", SCENES, ids=lambda one: one.stem)
def test_shipped_files_raise_no_question(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(path)
    assert not [one for one in caplog.messages if "unusual" in one or "is it in" in one]


@pytest.mark.parametrize("kind", bodies())
def test_usual_values_raise_no_question(kind: str, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(file_of(kind, lambda _: None))
    assert not caplog.messages


@pytest.mark.parametrize(("units", "span"), [("m", "120"), ("cm", ""), ("mm", ""), ("inch", "")])
def test_the_span_of_a_mesh_is_asked_about(units: str, span: str, caplog: pytest.LogCaptureFixture) -> None:
    """A bracket of 120 mm that is said to be in m is one of 120 m."""
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(PROJECT / "cases" / "scenes" / "bracket.toml", {"structure.bracket.model.units": units})
    found = [one for one in caplog.messages if "its span as length" in one]
    assert len(found) == bool(span)
    assert not span or f"length = {span} is unusual; the unit is m, not mm; is it in mm, 0.12 m?" in found[0]
