"""What may be wrong with a forecast, in sentences."""
