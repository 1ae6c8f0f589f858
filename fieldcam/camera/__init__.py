"""Flash stereo cameras: the port, and the cameras that need no hardware."""
