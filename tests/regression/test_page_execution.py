"""The commands and the Python of pages are executed as they stand, but for the notes on the page that shorten them."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.execution.page_steps import page_steps
from docs.execution.pages_to_run import DOCS, pages_to_run
from docs.execution.step_runner import StepError, run_page, run_step

PAGES = pages_to_run()
MINUTES = dict.fromkeys(("README", "from-python", "export-records", "begin-a-case", "use-in-another-simulator"), 0.5)
"""What newcomers copy first: short enough for CI, which leaves longer tests out."""
PAGE = """# A page

<!-- save as: mine.toml -->

    [beam]
    length = 1.0

    environment/run gapbeam check mine.toml

<!-- run with: --set time.end=0.1 -->
<!-- replace: CASE -> cases/demo.toml -->
<!-- first: gapbeam new mine.toml -->
<!-- ends with: 3 -->

    environment/run gapbeam run CASE > log.txt
    make demo
    environment/run gapbeam plot results/demo

<!-- not run: it takes a night -->

```python
import gapbeam
```

```python
x = 1
```

```python
assert x == 1
```
"""


def test_notes_change_what_is_executed(tmp_path: Path) -> None:
    """Every kind of note has its effect, other programs are left out, and Python blocks share their names."""
    page = tmp_path / "page.md"
    page.write_text(PAGE, encoding="utf-8")
    saved, check, new, run, plot, python = page_steps(page)
    assert (saved.kind, saved.file) == ("file", "mine.toml")
    assert saved.text.startswith("[beam]")
    assert [step.text for step in (check, new)] == ["gapbeam check mine.toml", "gapbeam new mine.toml"]
    assert run.text == "gapbeam run cases/demo.toml --set time.end=0.1 > log.txt"
    assert (plot.text, plot.status, run.status) == ("gapbeam plot results/demo", 3, 0)
    assert python.text.split() == ["x", "=", "1", "assert", "x", "==", "1"]
    assert run_step(python, tmp_path) == ""
    with pytest.raises(StepError, match="exit status 1, expected 0"):
        run_step(python._replace(text="assert False"), tmp_path)


def test_what_a_page_shows_is_compared_with_what_was_printed(tmp_path: Path) -> None:
    """The block after a program is its output, with numbers within the tolerance of the note; it is not executed."""
    page = tmp_path / "page.md"
    program, output = "```python\nprint('peak', 100.4, 'N')\n```", "```text\npeak {} N\n```"
    for shown in (100, 102):
        page.write_text(f"# P\n\n{program}\n\n<!-- output within: 1 % -->\n\n{output.format(shown)}\n", "utf-8")
        folder = tmp_path / str(shown)
        folder.mkdir()
        if shown == 100:
            assert run_page(page, folder) == 2
        else:
            with pytest.raises(StepError, match=r"the page shows 102, 100\.4 was printed"):
                run_page(page, folder)


@pytest.mark.parametrize("note", ["<!-- replace: CASE -> b -->\n\n    make demo", "<!-- ends with: 3 -->\n\nNo block."])
def test_a_note_without_use_is_refused(note: str, tmp_path: Path) -> None:
    """A note that no longer fits its page would let a block be executed unchanged."""
    page = tmp_path / "page.md"
    page.write_text(f"# A page\n\n{note}\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"is not in the block|before no block"):
        page_steps(page)


def test_pages_with_commands_are_found() -> None:
    """All tutorials have something to execute, and most how-to pages."""
    assert set((DOCS / "tutorials").glob("*.md")) <= set(PAGES)
    assert len(PAGES) > 30


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem, marks=pytest.mark.slow(minutes=MINUTES.get(page.stem, 2.0))) for page in PAGES],
)
def test_pages_run_as_they_stand(page: Path, tmp_path: Path) -> None:
    """Every command and program of the page ends with the status that the page says, 0 otherwise."""
    assert run_page(page, tmp_path) > 0
