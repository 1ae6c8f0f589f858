"""From one rectified pair to what it says about a cluster: pure functions on arrays."""
