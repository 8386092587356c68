"""Checkpoints of a march, and how it goes on from one."""
