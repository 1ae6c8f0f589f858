"""Cameras on the command line: what is attached, its settings, calibration."""
