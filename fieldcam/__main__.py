"""`python -m fieldcam` is the `fieldcam` command."""

from fieldcam.cli import entry_point

entry_point()
