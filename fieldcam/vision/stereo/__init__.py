"""Disparity of a rectified pair, by a network or by SGBM."""
