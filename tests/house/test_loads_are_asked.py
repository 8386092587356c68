"""No code outside of solver/loads knows which loads there are: it asks their traits."""

from __future__ import annotations

from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.schema.table import models_in
from tests.house.test_house_rules import FILES, PROJECT, imports, place

LOADS = PROJECT / "gapbeam" / "solver" / "loads"


def test_loads_are_not_imported_one_by_one() -> None:
    """Nothing imports the file of a load, or of what several loads have in common, but the room of the loads."""
    models = {base for model in models_in(Load) for base in model.__mro__ if base.__module__.startswith("gapbeam")}
    modules = {model.__module__ for model in models if model.__module__.startswith("gapbeam.solver.loads")}
    assert len(modules) > 6
    outside = [path for path in FILES if not path.is_relative_to(LOADS)]
    outside += sorted((PROJECT / "benchmarks").rglob("*.py"))
    assert [f"{place(path, line)} {name}" for path in outside for name, line in imports(path) if name in modules] == []


def test_types_of_loads_are_not_compared() -> None:
    """Nothing but their own files and the texts of case files in Python writes the name of a load's type."""
    names = {str(model.model_fields["type"].annotation) for model in models_in(Load)}
    assert len(names) == len(models_in(Load))
    words = [f'.type {sign} "{name.split(chr(39))[1]}"' for name in names for sign in ("==", "!=")]
    outside = [path for path in FILES if not path.is_relative_to(LOADS)]
    outside += sorted((PROJECT / "benchmarks").rglob("*.py"))
    assert [f"{place(path)} {word}" for path in outside for word in words if word in path.read_text("utf-8")] == []
