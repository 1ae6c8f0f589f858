"""Growth, evaluation and export on the command line."""
