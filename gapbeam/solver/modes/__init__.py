"""Vibration modes of a beam as contact holds it."""
