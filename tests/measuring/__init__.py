"""How fast and how small the app is; `make measure` prints it."""
