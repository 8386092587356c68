"""What benchmarks.structure counts, on a source of a few lines that was counted by hand."""

from __future__ import annotations

from pathlib import Path

from benchmarks.structure import PACKAGES, measured

SOURCE = {
    "solver/gap.py": "from gapbeam.studies.sweep import Sweep\nimport numpy\n\nclass Gap:\n    pass\n",
    "solver/contact/gap.py": "from gapbeam.meshes import box\n\ndef known(load):\n    return isinstance(load, int)\n",
    "studies/sweep.py": "from gapbeam.solver.gap import Gap\n\nclass Gap:\n    pass\n",
    "meshes/box.py": "import gapbeam.solver.gap\n\ndef asked(case):\n    return isinstance(case.model, int)\n",
    "postprocess/plot.py": "from gapbeam.solver.record_table import RECORDS\n",
    "gapbeam/api.py": "from gapbeam.solver.gap import Gap\n",
}


def test_measures_of_a_small_source(tmp_path: Path) -> None:
    """Two imports go upward (solver to studies, meshes to solver); names of records may be read from postprocess."""
    for package in PACKAGES:
        (tmp_path / package).mkdir()
    (tmp_path / "solver" / "contact").mkdir()
    for name, text in SOURCE.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "gapbeam" / "solver").symlink_to(Path("..") / "solver")
    assert measured(tmp_path) == {
        "files directly in solver/": 1,
        "folders in solver/": 1,
        "files": 6,
        "lines": 19,
        "lines of solver/": 9,
        "median lines of a file": 4,
        "lines of the longest file": 5,
        "file names that repeat": 1,
        "class names that repeat": 1,
        "imports of a package above": 2,
        "questions for the class of a load, law, scheme or formulation": 1,
        "questions for the class of a model, support or joint": 1,
    }
