"""Sections of reports on results folders, one kind of finding a file."""
