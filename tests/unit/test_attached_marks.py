"""Marks of joints, masses and fluids in pictures."""

from __future__ import annotations

import numpy as np

from gapbeam.postprocess.results.columns_of_run import supports_of
from gapbeam.postprocess.scene.support_surface import Mark, marks_of, placed, support_of
from gapbeam.solver.loads.attachments import JointChoice
from gapbeam.solver.schema.table import models_in, type_name


def test_marks_stand_where_joints_masses_and_fluids_are() -> None:
    """Places count from the end of the mesh, and cases of earlier releases have no marks."""
    case = {
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "mass": [{"name": "head", "point": 0.4, "mass": 1.0}],
        "fluid": [{"name": "water", "from": 0.2, "to": 0.3}],
    }
    marks = [Mark("root", 0.1, "s"), Mark("head", 0.5, "o"), Mark("water", 0.1 + 0.2, "", 0.1 + 0.3)]
    assert list(marks_of(case, 0.1)) == marks
    assert list(marks_of({}, 0.0)) == []
    beside = {"name": "head", "point": 0.4, "mass": 1.0}
    solid, flat = ({"mass": [beside | {"offset": offset}]} for offset in ([0.1, 0.02, -0.03], [0.1, -0.03]))
    assert list(marks_of(solid, 0.0)) == [Mark("head", 0.5, "o", away=(0.02, -0.03), ahead=0.1)]
    assert list(marks_of(flat, 0.0)) == [Mark("head", 0.5, "o", away=(0.0, -0.03), ahead=0.1)]


def test_every_kind_of_joint_has_a_mark_of_its_own() -> None:
    """The kinds are those of the schema."""
    kinds = [type_name(model) for model in models_in(JointChoice)]
    marks = marks_of({"joint": [{"name": kind, "type": kind, "point": 0.0} for kind in kinds]}, 0.0)
    symbols = [mark.symbol for mark in marks]
    assert len(kinds) > 3
    assert len(set(symbols)) == len(kinds)


def test_marks_are_placed_on_the_axis_and_names_above_the_beam() -> None:
    """In the middle of the width of a solid; a fluid takes up its part of what is shown, from bottom to top."""
    points = np.array([[0.0, -0.01, -0.02], [0.5, 0.01, 0.02]])
    support = support_of(points, 3, supports_of({}, {"support": {"length": 0.05, "clearance": 1e-4}}))
    head, water = placed(
        [Mark("head", 0.4, "o"), Mark("water", 0.2, "", 0.3)], support, (-0.1, 0.1), lambda places: places[:, [0, 2]]
    )
    np.testing.assert_allclose(head.at, [0.4, 0.0], atol=1e-15)
    np.testing.assert_allclose(head.above, [0.4, 0.02])
    [low] = placed([Mark("low", 0.4, "o", away=(0.01, -0.03))], support, (-0.1, 0.1), lambda places: places[:, [1, 2]])
    np.testing.assert_allclose(low.at, [0.01, -0.03], atol=1e-15)
    [far] = placed([Mark("far", 0.4, "o", ahead=0.1)], support, (-0.1, 0.1), lambda places: places[:, [0, 2]])
    assert low.root is not None
    assert far.root is not None
    np.testing.assert_allclose([low.root, far.root], [[0.0, 0.0], [0.3, 0.0]], atol=1e-15)
    assert head.root is None
    assert head.outline is None
    np.testing.assert_allclose(water.at, [0.25, 0.0], atol=1e-15)
    assert water.outline is not None
    np.testing.assert_allclose(water.outline, [[0.2, -0.1], [0.3, -0.1], [0.3, 0.1], [0.2, 0.1]])
