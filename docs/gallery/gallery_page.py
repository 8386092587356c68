"""The page of the gallery: for each scene a title, a text, a picture and the command."""

from __future__ import annotations

import tomllib

from docs.gallery.gallery_scenes import FOLDER, Scene, scenes

PAGE = FOLDER.parent / "gallery.md"
OPENING = """# What can gapbeam show?

Each scene is a shipped case: its command computes it, and `gapbeam render` or `gapbeam plot` draws it.
"""


def title(scene: Scene) -> str:
    """Return the title of the case of a scene."""
    return str(tomllib.loads(scene.case.read_text(encoding="utf-8"))["title"])


def section(scene: Scene) -> str:
    """Return heading, picture, text and command of a scene."""
    return (
        f"## {title(scene)}\n\n{scene.text}\n\n![{scene.file.stem}](gallery/scenes/{scene.file.name})\n\n"
        f"    {scene.command}\n"
    )


def page() -> str:
    """Return the page."""
    return "\n".join([OPENING, *map(section, scenes())])


def write_page() -> None:
    """Write docs/gallery.md."""
    PAGE.write_text(page(), encoding="utf-8")
