"""The command line: one module for each group of commands, heavy imports deferred."""

from fieldcam.cli.main import entry_point, main

__all__ = ["entry_point", "main"]
