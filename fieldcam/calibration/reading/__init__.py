"""Calibrations of all programs: their files, read."""
