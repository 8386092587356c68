"""Sources of a case in Python: a path, a text, a dict of tables, a case, or the case of a session and its scene.

A longer run continues until the interval of a statistic is narrow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.process.launcher import all_ranks
from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.case.model_choice import chosen_case
from gapbeam.solver.case.reading import case_reader
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.case.reading.value_words import toml_value
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import apart, printable
from gapbeam.studies.trials.axes import Axis, Spacing, read_axis

if TYPE_CHECKING:
    from mpi4py import MPI

    from gapbeam.solver.case.case import Case
    from gapbeam.solver.run.stop_rule import StopRule
    from gapbeam.solver.scene.scene import Scene


class UserCase(Case):
    """A case from `gapbeam.read_case`; a notebook shows its case file."""

    @classmethod
    def of(cls, case: Case) -> UserCase:
        """Return a case with the same tables, and the same keys left to their defaults."""
        return cls.model_construct(case.model_fields_set, **vars(case))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Case) and vars(self) == vars(other)

    __hash__ = Case.__hash__

    def scene(self) -> Scene:
        """Return the scene of a case with a reduced, beam or rigid model.

        Raises:
            UserError: The case has what a scene has no noun for.
            MeshError: The mesh file does not fit the case.

        Collective.
        """
        from gapbeam.interface.case_scene import scene_of_model
        from gapbeam.solver.march.simulation import Simulation

        return scene_of_model(self, Simulation.of_case(self, all_ranks()).model)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(case_to_toml(self))}</pre>"


CaseSource = str | PathLike[str] | Mapping[str, object] | Case
NAME = "case"  # of a case that has no file
COPY = "case-of-the-study.toml"


def read_case(source: CaseSource, overrides: Overrides = ()) -> UserCase:
    """Read a case, with every default filled in.

    Args:
        source: The path of a case file; its text, which has more than one line; a dict of its tables; or a case.
        overrides: Keys to replace, such as {"support.clearance": 0.1e-3} or ["support.clearance=0.1e-3"].

    Returns:
        The case, of which `scene()` returns the scene; it cannot be changed. Paths of mesh files and records are
        absolute in it; in a text or a dict they are relative to the current folder.

    Raises:
        CaseError: The file cannot be read, or the case has faults; all of them are in the message.
    """
    _refuse_scene(source)
    return UserCase.of(_read(source, overrides))


def _read(source: CaseSource, overrides: Overrides) -> Case:
    if isinstance(source, Case):
        return case_reader.read_case_text(case_to_toml(source), overrides, NAME) if overrides else chosen_case(source)
    if isinstance(source, Mapping):
        return case_reader.read_case_tables(source, overrides, NAME)
    if isinstance(source, str) and "\n" in source:
        return case_reader.read_case_text(source, overrides, NAME)
    return case_reader.read_case(Path(source), overrides)


def _refuse_scene(source: object) -> None:
    """Refuse a scene, or what is no source at all, where a case is asked for.

    Raises:
        UserError: The source is none of a case.
    """
    if isinstance(source, str | PathLike | Mapping | Case):
        return  # what reads a case does not load what marches a scene
    from gapbeam.solver.scene.scene import Scene

    if isinstance(source, Scene):
        raise UserError(
            "found a scene, expected a case; `gapbeam.run` marches one scene into a folder, `gapbeam.ensemble` many "
            'members of it side by side: ensemble(scene, {"left.clearance": values}, step=, end=)'
        )
    raise UserError(f"found {printable(source)}, expected a case: the path of its file, its text or its tables")


def shared_case(source: CaseSource, overrides: Overrides, comm: MPI.Comm) -> UserCase:
    """Read a case on rank 0 for all ranks; errors as in `read_case`. Collective."""
    from gapbeam.meshes.rank_zero import on_rank_zero

    return on_rank_zero(comm, lambda: read_case(source, overrides))


def name_of(source: CaseSource) -> str:
    """Return the name of a case, by which its results folder is called: that of its file, or "case"."""
    if isinstance(source, Case | Mapping) or (isinstance(source, str) and "\n" in source):
        return NAME
    _refuse_scene(source)
    return Path(source).stem


def case_file(source: CaseSource, folder: Path) -> Path:
    """Return the file of a case for the processes of a study; a case without a file is written into its folder.

    Raises:
        CaseError: The case has faults.
        UserError: The folder cannot be written.
    """
    if not isinstance(source, Case | Mapping) and not (isinstance(source, str) and "\n" in source):
        return Path(source)
    from gapbeam.solver.run.output.results_folder import check_place, write_beside

    if case_reader.is_scene(source):
        raise UserError("found the text or tables of several structures; expected the path of their file: write it")
    text = case_to_toml(read_case(source), ["the case of the study in this folder"])
    check_place(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_beside(folder / COPY, text)
    except OSError as error:
        raise UserError(f"{folder} cannot be written ({error.strerror}); choose another `output=`") from error
    return folder / COPY


def override_texts(overrides: Overrides) -> list[str]:
    """Return overrides as texts KEY=VALUE."""
    if isinstance(overrides, Mapping):
        return [f"{key}={_inline(value)}" for key, value in overrides.items()]
    return [overrides] if isinstance(overrides, str) else list(overrides)


def axis_of(key: str, values: str | Sequence[object], spacing: Spacing = "linear") -> Axis:
    """Return an axis of a study.

    Args:
        key: Key of the case.
        values: A list, or text as on the command line: "a,b,c" or "first:last:count".
        spacing: Spacing of a range that does not say.

    Raises:
        UserError: There are no values, or a range is none.
    """
    if isinstance(values, str):
        return read_axis(f"{key}={values}", spacing, "")
    typed = tuple(value if isinstance(value, str) else _inline(value) for value in values)
    if not typed:
        raise UserError(f"{key}: found no values; expected at least one")
    return Axis(key, typed)


def _inline(value: object) -> str:
    """Return a value as TOML writes it in one line."""
    plain = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    if isinstance(plain, Mapping):
        return "{" + ", ".join(f"{key} = {_inline(inner)}" for key, inner in plain.items()) + "}"
    if isinstance(plain, list | tuple):
        return "[" + ", ".join(map(_inline, plain)) + "]"
    return toml_value(plain)


def folder_from(output: str | PathLike[str] | None, default: str) -> Path:
    """Return the folder that is asked for, or results/<default>.

    Raises:
        UserError: The output is an empty word.
    """
    if isinstance(output, str) and not output.strip():
        raise UserError(f"`output=` {output!r}: an empty word; expected a folder, or None")
    return Path(output) if output is not None else Path("results") / default


def check_range(name: str, value: float | None, least: float, most: float = float("inf")) -> None:
    """Refuse an argument out of its range; None is in it.

    Raises:
        UserError: The value is out of its range.
    """
    if value is not None and not least <= value <= most:
        limits = f"at least {least:g}" if most == float("inf") else f"a number from {least:g} to {most:g}"
        raise UserError(f"`{name}=`: found {value!r}; expected {limits}")


def check_fraction(name: str, value: float) -> None:
    """Refuse a fraction that is not between 0 and 1.

    Raises:
        UserError: The value is not between 0 and 1.
    """
    if not 0.0 < value < 1.0:
        raise UserError(f"`{name}=`: found {value!r}; expected a fraction between 0 and 1, such as 0.02")


LONGER = 10.0  # times time.end is the longest run by default


def case_and_rule(
    source: CaseSource,
    overrides: Overrides,
    relative_error: float | None,
    of: str | None,
    at_most: float | None,
    comm: MPI.Comm,
) -> tuple[Case, StopRule | None]:
    """Return the case of a run and when it may end.

    With a relative error, `time.end` is the earliest end, and the case that is run ends at `at_most`.

    Args:
        source: As in `gapbeam.run`, like those that follow.
        overrides: Keys to replace.
        relative_error: Relative error of the figure; None: the run ends at `time.end`.
        of: The figure.
        at_most: Longest time that is marched, s; None: 10 times `time.end`.
        comm: The ranks that read.

    Raises:
        CaseError: The case has faults.
        UserError: The options do not go together, or not with the case.

    Collective.
    """
    case = shared_case(source, overrides, comm)
    if relative_error is None and of is None and at_most is None:
        return case, None
    if relative_error is None or of is None:
        lacking = "relative_error" if relative_error is None else "of"
        raise UserError(
            f"`{lacking}=` is missing: a run goes on until the interval of one figure is narrow, such as "
            '`relative_error=` 0.01 with `of=` "probe.tip.rms"'
        )
    from gapbeam.solver.run.stop_rule import StopRule

    end = case.time.end
    longest = LONGER * end if at_most is None else at_most
    if not (isfinite(longest) and longest >= end):
        found, least = apart(longest, end)
        raise UserError(f"`at_most=`: found {found} s; expected at least time.end, {least} s, when the run may end")
    rule = StopRule(of, relative_error, end)
    rule.refuse_misfit(case)
    return shared_case(case, {"time.end": longest}, comm), rule
