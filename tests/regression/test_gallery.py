"""Every scene of the gallery in a short run: its largest contact force is what it was when the picture was drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.gallery.gallery_scenes import Scene, scenes


@pytest.mark.parametrize(
    "scene", [pytest.param(one, id=one.name, marks=pytest.mark.slow(minutes=one.minutes)) for one in scenes()]
)
def test_scene(scene: Scene, tmp_path: Path) -> None:
    assert scene.measured(tmp_path / scene.name) == pytest.approx(scene.force, rel=scene.tolerance)
