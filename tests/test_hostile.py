"""Hostile input ends with exit status 2 and a message: what fuzzing found, and what it is likely to find again."""

from __future__ import annotations
