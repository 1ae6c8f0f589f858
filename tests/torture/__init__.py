"""What the app must survive: kills, a full disk, power cuts, an analysis that misbehaves.

`make torture` runs all of it and prints a table; the tests run a short version.
Each program is seeded, so that a failure can be run again.
"""
