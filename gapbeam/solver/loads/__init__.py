"""Loads: functions of time, recorded signals and exciters."""
