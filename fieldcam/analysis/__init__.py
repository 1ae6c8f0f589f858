"""Runs vision on saved pairs."""
