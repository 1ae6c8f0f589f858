"""`python -m fieldcam` is the `fieldcam` command."""

from fieldcam.safe_path import leave_working_folder

leave_working_folder()

from fieldcam.cli import entry_point  # noqa: E402 (nothing else may be imported before)

entry_point()
