"""Hostile input for every reader: mutated real files, links and bombs, each tried in a process of its own."""
