"""Page as PDF, printed by a Chromium without a window: the same words, tables and figures, laid out for paper."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

BROWSERS = (
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome-stable",
    "google-chrome",
    "chrome",
    "microsoft-edge",
    "msedge",
    "brave-browser",
)
VARIABLE = "GAPBEAM_BROWSER"
LONGEST = 120.0  # s; a page of thirty figures takes less than ten

# As root and in containers the sandbox cannot start and /dev/shm is small; the page is ours and may load nothing. A
# browser without a network, a profile or a screen has nothing to wait for.
OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--no-first-run",
    "--no-default-browser-check",
    "--no-pings",
    "--proxy-server=127.0.0.1:9",
    "--hide-scrollbars",
)


class BrowserError(Exception):
    """No browser, or one that printed nothing."""

    exit_status = 2


def find_browser() -> str:
    """Return the browser that prints: the one that the variable GAPBEAM_BROWSER names, or the first that is installed.

    Raises:
        BrowserError: No browser was found.
    """
    named = os.environ.get(VARIABLE)
    candidates = (named,) if named else BROWSERS
    found = next((path for path in map(shutil.which, candidates) if path), None)
    if found is None:
        raise BrowserError(
            f"{VARIABLE}={named}: no such program; expected a Chromium or its like"
            if named
            else "no browser to print the PDF with; install chromium (Debian: chromium-headless-shell; container:"
            f" the image gapbeam:pdf), name one with {VARIABLE}, or print the page from any browser"
        )
    return found


def write_pdf(page: Path, path: Path, browser: str | None = None, longest: float = LONGEST) -> Path:
    """Print a page of `gapbeam.postprocess.report.html_page` as PDF, A4, tagged and with an outline.

    Args:
        page: The HTML file.
        path: File to write; one that is there is replaced only by a whole one.
        browser: Program; by default the one that `find_browser` finds.
        longest: s, after which the browser is ended.

    Returns:
        The path.

    Raises:
        BrowserError: There is no browser, it failed, or it took too long.
    """
    browser = browser or find_browser()
    with tempfile.TemporaryDirectory(prefix="gapbeam-pdf-", ignore_cleanup_errors=True) as folder:
        printed = Path(folder) / "page.pdf"
        command = [
            browser, *OPTIONS, f"--user-data-dir={folder}/profile", "--no-pdf-header-footer", "--export-tagged-pdf",
            "--generate-pdf-document-outline", f"--print-to-pdf={printed}", f"{page.resolve().as_uri()}#print",
        ]  # fmt: skip
        said = _run(command, longest)
        if not printed.is_file() or not printed.read_bytes().rstrip().endswith(b"%%EOF"):
            raise BrowserError(f"{browser} printed no PDF of {page}; it said: {said}")
        part = path.with_name(path.name + ".part")
        shutil.copyfile(printed, part)
        part.replace(path)
    return path


def _run(command: list[str], longest: float) -> str:
    """Run a browser to its end, with all processes that it starts; return the last lines it said."""
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            errors="replace", start_new_session=True,
        )  # fmt: skip
    except OSError as error:
        raise BrowserError(f"{command[0]} cannot be started ({error.strerror})") from error
    try:
        _, said = process.communicate(timeout=longest)
    except subprocess.TimeoutExpired as late:
        raise BrowserError(f"{command[0]} did not print within {longest:g} s and was ended") from late
    finally:
        _end(process)
    return " | ".join(said.splitlines()[-3:]) or "nothing"


def _end(process: subprocess.Popen[str]) -> None:
    """End a browser and its processes, where they still run."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return
    process.wait()
