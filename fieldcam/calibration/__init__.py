"""Reads calibrations, rectifies raw pairs, and notices when a calibration has drifted."""
