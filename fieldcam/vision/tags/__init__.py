"""AprilTags in a picture: found, placed in space, found again in the right eye."""
