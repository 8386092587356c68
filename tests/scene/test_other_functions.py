"""Studies and runs recognise a scene by all that its functions depend on, not by their names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

Make = Callable[[float], gb.Scene]


def scene_of(
    law: Any = None, region: Any = None, force: Any = 3.0, motions: int = 2, **parameters: Any
) -> gb.Scene:  # fmt: skip
    """A mass that is pushed against a wall."""
    body = gb.mass(1.0, motions, stiffness=100.0, name="body")
    wall = gb.Contact(body["at"], region or gb.Disc(1e-3), law or gb.KelvinVoigt(1e4), name="wall")
    return gb.Scene(body, contacts=[wall], loads=[gb.Force(body["at"], force, name="push", **parameters)])


def closure_of_a_law(c: float) -> gb.Scene:
    @gb.law(potential=lambda x, k: 0.5 * c * k * x * x)
    def Own(x, k):  # type: ignore[no-untyped-def]  # noqa: N802
        return c * k * x

    return scene_of(Own(1e4))


def constant_of_a_law(c: float) -> gb.Scene:
    @gb.law(potential=lambda x, k: 0.5 * k * x * x)
    def Two(x, k):  # type: ignore[no-untyped-def]  # noqa: N802
        return 1.0 * k * x

    @gb.law(potential=lambda x, k: 1.0 * k * x * x)
    def Four(x, k):  # type: ignore[no-untyped-def]  # noqa: N802
        return 2.0 * k * x

    kinds = {1.0: Two, 2.0: Four}
    return scene_of(gb.law(potential=kinds[c].potential)(_named(kinds[c].spring.py_func))(1e4))


def _named(function: Any) -> Any:
    function.__name__ = "Own"
    return function


def damper_of_a_law(c: float) -> gb.Scene:
    @gb.law(potential=lambda x, k: 0.5 * k * x * x, damper=lambda N, share, rate, k: c * N * rate)  # noqa: ARG005
    def Own(x, k):  # type: ignore[no-untyped-def]  # noqa: N802
        return k * x

    return scene_of(Own(1e4))


def closure_of_a_region(c: float) -> gb.Scene:
    @gb.region
    def Own(x, y):  # type: ignore[no-untyped-def]  # noqa: N802
        return np.hypot(x, y) - 1e-3 * c

    return scene_of(region=Own())


def called_by_a_region(c: float) -> gb.Scene:
    import numba

    radius = numba.njit(lambda angle: 1e-3 * c + 0.0 * angle)

    @gb.region
    def Own(x, y):  # type: ignore[no-untyped-def]  # noqa: N802
        return np.hypot(x, y) - radius(x)

    return scene_of(region=Own())


def pulse(c: float) -> gb.Scene:
    """A blow between the times at which loads are sampled."""
    return scene_of(force=lambda t: np.where(np.abs(t - 0.05) < 1e-4, 2e3 * c, 0.0))


def table(c: float) -> gb.Scene:
    return scene_of(force=([0.0, 0.0499, 0.05, 0.0501, 1.0], [0.0, 0.0, 2e3 * c, 0.0, 0.0]))


def method(c: float) -> gb.Scene:
    class Hammer:
        def __init__(self, size: float) -> None:
            self.size, self.lock = size, Lock()

        def blow(self, t: Any, at: float) -> Any:
            return np.where(np.abs(t - at) < 1e-4, 2e3 * self.size, 0.0)

    return scene_of(force=Hammer(c).blow, at=0.05)


MADE: list[Make] = [
    closure_of_a_law, constant_of_a_law, damper_of_a_law, closure_of_a_region, called_by_a_region, pulse, table, method,
]  # fmt: skip


@pytest.mark.parametrize("made", MADE)
def test_an_ensemble_of_other_functions_is_refused(made: Make, tmp_path: Path) -> None:
    """Functions of one name with another constant, closure or damper march otherwise: blocks are not taken for them."""
    values = {"wall.friction": np.zeros(3)}
    times: dict[str, Any] = {"step": 1e-4, "end": 0.2}
    one, other = (gb.ensemble(made(c), values, **times).peak["at"] for c in (1.0, 2.0))
    assert not np.array_equal(one, other), "the two scenes march in the same way"
    for _ in range(2):
        kept = gb.ensemble(made(1.0), values, output=tmp_path / "many", **times)
        assert np.array_equal(kept.peak["at"], one)
    with pytest.raises(gb.UserError, match="another ensemble"):
        gb.ensemble(made(2.0), values, output=tmp_path / "many", **times)


@pytest.mark.parametrize("made", [closure_of_a_law, damper_of_a_law, closure_of_a_region, pulse])
def test_a_run_of_other_functions_is_not_resumed(made: Make, tmp_path: Path) -> None:
    asked: dict[str, Any] = {"step": 1e-4, "end": 0.1, "output": tmp_path / "run", "errors": False}
    gb.run(made(1.0), **asked)
    gb.run(made(1.0), resume=True, **asked)
    with pytest.raises(gb.UserError, match="another scene"):
        gb.run(made(2.0), resume=True, **asked)


def models(scale: float) -> Iterator[Callable[[dict[str, Any]], dict[str, Any]]]:
    """Functions of values that differ by a number, an array, a scene or a function that they call."""
    array, body = np.array([scale]), gb.mass(scale, stiffness=9.0, name="body")
    scene = gb.Scene(body, loads=[gb.Force(body["at"], 1.0)])

    def called(x: Any) -> Any:
        return scale * x

    yield lambda x: {"y": scale * x["a"]}
    yield lambda x: {"y": array[0] * x["a"]}
    yield lambda x: {"y": called(x["a"])}
    yield lambda x: {"y": np.full(len(x["a"]), gb.history(scene, 0.1, 0.5).displacement["at"][-1])}


@pytest.mark.parametrize("number", range(4))
def test_an_uncertain_study_of_another_function_is_refused(number: int, tmp_path: Path) -> None:
    from scipy import stats

    one, same, other = (list(models(scale))[number] for scale in (1.0, 1.0, 2.0))
    asked: dict[str, Any] = {"members": 16, "replicates": 4, "output": tmp_path / "study"}
    found = gb.uncertain(one, {"a": stats.norm()}, **asked)
    assert np.array_equal(gb.uncertain(same, {"a": stats.norm()}, **asked).figures["y"], found.figures["y"])
    with pytest.raises(gb.UserError, match="another ensemble"):
        gb.uncertain(other, {"a": stats.norm()}, **asked)


TABLES = [([0, 2, 1], [0, 3, 0]), ([0, 1, 1], [0, 3, 0]), ([0, 1], [0, 3, 0]), (1, 2), ([0, 1],), ([0], [0], [0])]


@pytest.mark.parametrize("given", TABLES)
def test_tables_are_checked_wherever_they_are_given(given: Any) -> None:
    """When the load is made, by `with_` and between steps: unsorted times would be interpolated to any value."""
    with pytest.raises(gb.UserError, match="push: expected as many values as times, and times that grow"):
        scene_of(force=given)
    scene = scene_of()
    with pytest.raises(gb.UserError, match="push: expected as many values as times, and times that grow"):
        scene.with_({"push.value": given})
    next(gb.march(scene, 1e-3, 0.1))
    with pytest.raises(gb.UserError, match="push: expected as many values as times, and times that grow"):
        scene.loads[0].value = given


def test_an_ensemble_needs_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(gb.UserError, match="give another folder"):
        gb.ensemble(scene_of(), {"wall.friction": [0.0]}, step=1e-3, end=0.1, output=tmp_path / "file")
