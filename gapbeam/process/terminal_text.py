"""Text for the terminal: without control characters, and with options of the command line for keys."""

from __future__ import annotations

import logging
import re

ARGUMENT = re.compile(r"`(\w+)=(?:True)?`")
OPTIONS = {"zipped": "zip", "overrides": "set"}  # where the option is not called as the argument is


def harmless(text: object) -> str:
    """Return a text whose control characters, which a file may have brought, are written out; lines stay lines."""
    return "".join(
        one if one.isprintable() or one in "\n\t" else one.encode("unicode_escape").decode("ascii") for one in str(text)
    )


def with_options(text: object) -> str:
    """Return a message with arguments of Python calls, `output=` or `resume=True`, as options: --output, --resume."""
    return ARGUMENT.sub(lambda found: f"--{OPTIONS.get(found[1], found[1]).replace('_', '-')}", str(text))


class OptionWords(logging.Filter):
    """Lets log lines of the command line name its options; a log line of a Python session names arguments."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Rewrite a log line."""
        record.msg, record.args = with_options(record.getMessage()), ()
        return True
