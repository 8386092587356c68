"""First screen of reports: loads on the faces with intervals, amber where a figure may not be used, things to do."""

from __future__ import annotations

from typing import Any

from gapbeam.postprocess.report.blocks import Verdict
from gapbeam.postprocess.report.sections.support_section import doubts_of_figures, support_table, things_to_do


def figure(name: str, value: float, relative: float | None, error: float | None = None) -> dict[str, Any]:
    """Return a figure as the summary has it."""
    found = None if relative is None else relative * value
    return {"name": name, "span": "settled part", "value": value, "error": error or found, "relative_error": relative}


def summary(**more: Any) -> dict[str, Any]:
    """Return the summary of a run whose figures may be used."""
    figures = [
        figure("base largest recorded force", 412.9, 0.04),
        figure("base impulse", 0.5, 0.02),
        figure("gland largest mean force", 300.0, 0.3),
        figure("gland impulse", 0.25, None, 0.4),
    ]
    errors = {
        "status": "estimated", "horizon": None, "settled_part_repeats": False, "figures": figures,
        "spans": [{"name": "settled part", "width": 0.05}],
    }  # fmt: skip
    faces = {"base": {"count": 12, "rate": 40.0}, "gland": {"count": 3, "rate": 10.0}}
    closing = {"part": "settled part", "rows": [{"figure": "tip peak-to-peak displacement", "verdict": "good"}]}
    return {"impacts": {"support": {"faces": faces}}, "errors": errors, "closing": closing} | more


def test_each_face_has_its_loads_with_intervals() -> None:
    """Peaks that records do not resolve are means with a star; wear is a column where it is known."""
    table = support_table(summary())
    assert table is not None
    assert table.columns == ("face", "peak force (N)", "impulse in 0.05 s (mN s)", "impacts (1/s)", "use of the peak")
    assert table.rows == [
        ("base", "413 ± 4.0 %", "500 ± 2.0 %", "40.0 (12 counted)", "good"),
        ("gland", "300 ± 30 % *", "250 ± 400", "10.0 (3 counted)", "rough"),
    ]
    assert "largest mean force" in table.notes[0]
    assert "without an interval" in table.notes[1]
    ranged = support_table(summary(errors=summary()["errors"] | {"impact_rates": {"base": [41.0, 60.0]}}))
    assert ranged is not None
    assert [row[3] for row in ranged.rows] == ["40.0 (40.0 to 60.0) †", "10.0 (3 counted)"]
    assert "comparison runs" in ranged.notes[1]
    counted = {"name": "face.base.impact_rate", "value": 40.0, "low": 30.0, "high": 50.0, "relative": 0.2}
    among = support_table(summary(statistics={"figures": [counted]}))
    assert among is not None
    assert among.rows[0][3] == "40.0 (30 to 50)"
    rate = {"value": 2e-9, "low": 1e-9, "high": 4e-9}
    worn = support_table(summary(wear={"faces": {"base": {"depth_rate": rate, "work_rate": rate}}}))
    assert worn is not None
    assert worn.columns[4] == "wear (m/s)"
    assert worn.rows[0][4] == "2.00\xa0×\xa010⁻⁹ (1.0\xa0×\xa010⁻⁹ to 4.0\xa0×\xa010⁻⁹)"
    bare = support_table({"peak_contact_force": {"base": 5.0}})
    assert bare is not None
    assert bare.rows == [("base", "5.00", "", "", "error not known")]
    scene = support_table({"peak_contact_force": {"rest": 5.0}, "impacts": {"rest": {"count": 4, "rate": 2.0}}})
    assert scene is not None
    assert scene.rows[0][3] == "2.00 (4 counted)"
    assert support_table({}) is None
    exact = [figure("base largest recorded force", 5.0, 1e-7), figure("base impulse", 5.0, 0.0)]
    small = support_table(summary(errors=summary()["errors"] | {"figures": exact}))
    assert small is not None
    assert small.rows[0][1:3] == ("5.00 ± less than 0.010 %", "5.00 ± 0 %")


def test_amber_wherever_a_figure_may_not_be_used() -> None:
    """Every doubt by itself; none where all figures may be used."""
    assert doubts_of_figures(summary()) == []
    assert things_to_do(summary()) == []
    steps = {"name": "contacts resolved by the step", "verdict": "warning", "closest": 0.5}
    wide = [figure("base largest recorded force", 412.9, 0.8)]
    errors = summary()["errors"]
    doubtful = {
        "peak forces are not resolved": {"assumptions": [steps]},
        "cannot be predicted after t = 0.300 s": {"errors": errors | {"horizon": 0.3}},
        "peak force on base may not be used": {"errors": errors | {"figures": wide}},
        "tip peak-to-peak displacement may not": {
            "closing": {"part": "", "rows": [{"figure": "tip peak-to-peak displacement", "verdict": "do not use"}]}
        },
        "the response has not settled": {"closing": {"part": "second half, not settled", "rows": []}},
        "1 statistics are too short": {"statistics": {"figures": [{"name": "probe.tip.rms", "verdict": "too short"}]}},
        "errors of the figures are not known": {"errors": {"status": "not estimated"}},
        "beyond its limit: small rotation": {"assumptions": [{"name": "small rotation", "verdict": "warning"}]},
    }
    for words, change in doubtful.items():
        assert any(words in doubt for doubt in doubts_of_figures(summary(**change))), words
    repeats = errors | {"horizon": 0.3, "settled_part_repeats": True}
    assert doubts_of_figures(summary(errors=repeats)) == []


def test_at_most_three_things_to_do() -> None:
    """Doubts first, then warnings that say what to do; a warning without advice is no thing to do."""
    steps = {"name": "contacts resolved by the step", "verdict": "warning", "closest": 0.5}
    texts = [
        "no advice here",
        "mesh is coarse; try a smaller mesh.size",
        "a; try b",
        "contacts resolved by the step: try",
    ]
    errors = summary()["errors"] | {"horizon": 0.3}
    (block,) = things_to_do(summary(assumptions=[steps], errors=errors, warnings=texts))
    assert isinstance(block, Verdict)
    lines = [line for line in block.text.splitlines() if line.startswith("- ")]
    assert [line[:20] for line in lines] == ["- **Take a smaller `", "- **Use averages, no", "- Mesh is coarse; tr"]
    assert "50 % of the impulse" in lines[0]
