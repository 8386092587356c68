"""Faults of frames stand at the key that has them, with advice that fits the kind of its values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import gapbeam as gb

Tables = dict[str, Any]


def tables() -> Tables:
    return {
        "structure": [
            {
                "name": "rack",
                "model": {
                    "type": "frame",
                    "route": [[0.0, 0.0, 0.0], [0.0, 0.0, 1.2], [1.0, 0.0, 1.2]],
                    "thickness": 0.03,
                    "material": {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": 7850.0},
                },
            }
        ],
        "member": [{"structure": "rack", "route": [[0.0, 0.0, 0.6], [0.8, 0.0, 1.2]], "hinged": ["start", "end"]}],
        "joint": [{"type": "clamped", "structure": "rack", "at": 0.0}],
        "point": [
            {"name": "leg", "structure": "rack", "at": 0.4, "direction": [1.0, 0.0, 0.0]},
            {"name": "top", "structure": "rack", "nearest": [1.0, 0.0, 1.2], "direction": [0.0, 0.0, 1.0]},
        ],
        "time": {"step": 1e-4, "end": 0.01},
    }


def put(owner: str, number: int, **values: Any) -> Callable[[Tables], None]:
    def change(given: Tables) -> None:
        given[owner][number] |= values

    return change


def turning(**values: Any) -> Callable[[Tables], None]:
    def change(given: Tables) -> None:
        del given["point"][0]["direction"]
        given["point"][0] |= values

    return change


FAULTS: dict[str, tuple[Callable[[Tables], None], str]] = {
    "no direction": (
        put("point", 1, direction=[0.0, 0.0, 0.0]),
        r'\[\[point\]\] number 2 \(name "top"\)(.|\n)*not all 0',
    ),
    "one of two": (
        put("point", 0, direction=[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        r'\[\[point\]\] number 1 \(name "leg"\)(.|\n)*not all 0',
    ),
    "no axis": (turning(about=[0.0, 0.0, 0.0]), r'\[\[point\]\] number 1 \(name "leg"\)(.|\n)*not all 0'),
    "skew": (
        put("point", 1, direction=[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]),
        r'\[\[point\]\] number 2 \(name "top"\)(.|\n)*not at right angles',
    ),
    "a free end": (
        put("member", 0, route=[[0.0, 0.0, 0.6], [0.8, 0.0, 0.9]]),
        r"\[\[member\]\] number 1 hinged(.|\n)*the end of member 1, which touches no axis, hinged",
    ),
    "a free start": (
        put("member", 0, route=[[0.8, 0.0, 0.9], [0.0, 0.0, 0.6]]),
        r"\[\[member\]\] number 1 hinged(.|\n)*the start of member 1, which touches no axis, hinged",
    ),
    "an end of another name": (put("member", 0, hinged=["both"]), r'hinged(.|\n)*each "start" or "end"'),
}  # fmt: skip


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_stand_at_their_key(fault: str) -> None:
    """No warning of NumPy stands before them, and no advice says to write texts as numbers."""
    change, words = FAULTS[fault]
    given = tables()
    change(given)
    with pytest.raises(gb.CaseError, match=words) as refused:
        gb.scene(given)
    assert "without quotes" not in str(refused.value)


def test_the_frame_without_faults_is_made() -> None:
    assert gb.scene(tables()).size > 6
