"""Tables of case files and of results: what keys and records have, their units and meaning."""
