"""A valid case from a seed: tables drawn, and drawn again where the reader finds that they contradict each other."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gapbeam
from benchmarks.drawn_schema.finishing import entries_of, finished
from benchmarks.drawn_schema.scene import drawn_scene
from benchmarks.drawn_schema.tables import Choice, Draw, all_choices
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import CaseError, Fault, UserError
from gapbeam.solver.schema.table import models_in

TRIES = 400  # of drawing tables again
SCENES = 40  # of drawing everything again
ARRAYS = ("segment", "load", "probe", "support", "joint", "mass", "fluid")
ALWAYS = ("mesh", "contact")  # drawn in every case: most choices are theirs, and the defaults of a mesh are fine ones
SCALES = ("beam", "support", "material")


class NoCaseError(RuntimeError):
    """No valid case with a choice was found."""


def drawn(seed: int, folder: Path) -> tuple[dict[str, Any], Choice]:
    """Return the tables of a case that the reader accepts, and the choice that it was drawn for.

    The choices of the schema take turns, from seed to seed; all else is left to chance.

    Args:
        seed: The same seed gives the same case.
        folder: Where the records of its loads go.

    Raises:
        NoCaseError: No case with this choice was found: the rules leave hardly any.
    """
    choices = all_choices()
    focus = choices[seed % len(choices)]
    for scene in range(SCENES):
        found = _drawn(random.Random(f"{seed} {scene}"), seed, folder, focus)
        if found is not None:
            return found, focus
    raise NoCaseError(f"no valid case with {focus} in {SCENES} scenes of {TRIES} draws")


def _drawn(chance: random.Random, seed: int, folder: Path, focus: Choice) -> dict[str, Any] | None:
    draw = Draw(chance, drawn_scene(chance, folder, seed), focus)
    tables = {key: _table(draw, key) for key in Case.model_fields}
    for _ in range(TRIES):
        whole = finished(draw, tables)
        try:
            gapbeam.read_case(whole)
        except CaseError as error:
            again = _of_faults(error.faults)
        except UserError:
            again = ["load"]
        else:
            return whole
        key = chance.choice(again or list(tables))
        tables[key] = _table(draw, key)
    return None


def _table(draw: Draw, key: str) -> Any:
    if key in ARRAYS:
        return entries_of(draw, key)
    if key in ALWAYS:
        return draw.table(models_in(Case.model_fields[key].annotation)[0])
    return draw.value(Case, key, Case.model_fields[key])


def _of_faults(faults: Sequence[Fault]) -> list[str]:
    """Return the tables that take part in faults; those that only hold the scales are not drawn again."""
    keys = [str(key[0]) for fault in faults for key in (fault.key, *fault.related) if key]
    return [key for key in keys if key in Case.model_fields and key not in SCALES]
