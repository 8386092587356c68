"""Which pages are executed: those that a reader copies commands from."""

from __future__ import annotations

from pathlib import Path

from docs.execution.page_steps import page_steps

DOCS = Path(__file__).parents[1]
KINDS = ("tutorials", "how-to")


def pages_to_run() -> list[Path]:
    """Return the README and the tutorials and how-to pages with something to execute."""
    pages = [DOCS.parent / "README.md", *(page for kind in KINDS for page in sorted((DOCS / kind).glob("*.md")))]
    return [page for page in pages if any(step.kind != "file" for step in page_steps(page))]
