"""Loads: functions of time, recorded signals and exciters; joints, masses and fluid attached to the beam."""
