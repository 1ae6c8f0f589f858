"""A data folder after a crash, a full disk or damage: found out, and mended."""
