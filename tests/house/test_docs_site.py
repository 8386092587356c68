"""What the site of the documentation is made of, without Sphinx: its contents, its pages from code, its looks."""

from __future__ import annotations

import json
import re
from pathlib import Path

import typer

import gapbeam
from docs.gallery.gallery_page import PAGE, page
from docs.gallery.gallery_scenes import scenes
from docs.pictures.frame_drawing import FILE, drawing
from docs.site.all_commands import commands_page
from docs.site.contents import contents, with_contents
from docs.site.notebook_file import TUTORIAL, cells, notebook
from docs.site.python_interface import interface
from docs.site.search_words import SEARCH_WORDS, with_search_words
from gapbeam.command_line import app
from tests.house.test_docs import PAGES

DOCS = Path(__file__).parents[2] / "docs"
INDEX = (DOCS / "index.md").read_text(encoding="utf-8")


def test_every_page_is_in_one_table_of_contents() -> None:
    """A page that is in none has no place in the site; one in two has two."""
    listed = [page for pages in contents(INDEX).values() for page in pages]
    assert sorted(listed) == sorted(str(path.relative_to(DOCS)) for path in PAGES if path != DOCS / "index.md")


def test_contents_are_hidden_behind_the_index() -> None:
    """The words of the links are the titles, and pages that the build makes follow."""
    first = "## First: of two\n\n[a](k/a.md) and [b](k/b.md#x), [c](k/c.md)\n\n"
    index = f"# All\n\n[a](k/a.md)\n\n{first}## Second\n\n[c](k/c.md)\n"
    assert contents(index) == {"First": {"k/a.md": "a", "k/c.md": "c"}, "Second": {}}
    made = with_contents(index, {"First": ["k/made.md"]})
    assert made.startswith(index.rstrip())
    assert "```{toctree}\n:hidden:\n:caption: First\n\nA <k/a>\nC <k/c>\nk/made\n```" in made
    assert made.count("{toctree}") == 1


def test_words_of_practice_find_a_page() -> None:
    """The search ranks entries of the index first: at most three pages for a word, each of which exists."""
    entries = [word for words in SEARCH_WORDS.values() for word in words]
    practice = "orifice,loose support,natural frequency,rattle,freeplay,snubber,gap,clearance,bumper,lift-off,fretting"
    practice += ",wear,impact,stick-slip,chatter,pipe whip,baffle,tube bundle,bolt,barrel"
    assert set(practice.split(",")) <= set(entries)
    assert max(map(entries.count, entries)) <= 3
    assert [word for word in entries if word != word.lower() or "," in word] == []
    assert [page for page in SEARCH_WORDS if not (DOCS / page).read_text(encoding="utf-8").startswith("# ")] == []
    assert with_search_words("# A\n\nText\n", ("a", "b c")) == "# A\n\n```{index} ! a, ! b c\n```\n\nText\n"


def test_commands_are_all_there() -> None:
    """Each command has a section, and each of its options a row."""
    text = commands_page()
    group = typer.main.get_command(app)
    shown = {name: command for name, command in group.commands.items() if not command.hidden}  # type: ignore[attr-defined]
    assert re.findall(r"^## (\S+)$", text, re.MULTILINE) == list(shown)
    for command in shown.values():
        for option in command.params:
            assert option.param_type_name != "option" or f"`{option.opts[0]}`" in text


def test_the_interface_is_all_there() -> None:
    """Every name that `import gapbeam` brings is found in the source, with its docstring."""
    assert set(interface()) == set(dir(gapbeam)) - {"__version__"}
    assert all(node.name == name for name, node in interface().items())


def test_the_gallery_is_what_its_scenes_say() -> None:
    """The page is made anew; pictures are small, and none is left over."""
    assert PAGE.read_text(encoding="utf-8") == page(), "run: environment/run python3 -m docs.gallery --page"
    pictures = {scene.file: scene.file.stat().st_size for scene in scenes()}
    assert set(pictures) == set((DOCS / "gallery" / "scenes").iterdir())
    assert len(pictures) >= 16
    assert max(pictures.values()) <= 60_000
    assert [scene.name for scene in scenes() if len(re.findall(r"\. [A-Z]", scene.text)) > 1] == []
    assert max(len(scene.text.split()) for scene in scenes()) <= 25


def test_the_frame_is_what_its_program_draws() -> None:
    """The drawing of axes, base, gland and clearance is made anew."""
    assert FILE.read_text(encoding="utf-8") == drawing(), "run: environment/run python3 docs/pictures/frame_drawing.py"


def test_the_notebook_is_its_tutorial() -> None:
    """The file is made anew; its code, cell after cell, comes from the page, which is executed; no outputs."""
    page = TUTORIAL.read_text(encoding="utf-8")
    file = TUTORIAL.with_suffix(".ipynb").read_text(encoding="utf-8")
    assert file == notebook(page), "run: environment/run python3 -m docs.site.notebook_file"
    read = json.loads(file)
    code = ["".join(cell["source"]) for cell in read["cells"] if cell["cell_type"] == "code"]
    assert code == [text for kind, text in cells(page) if kind == "code"]
    assert len(code) >= 5
    assert all(cell.get("outputs", []) == [] for cell in read["cells"])
    assert "```python" not in "".join("".join(cell["source"]) for cell in read["cells"])
