"""What the camera sees while somebody aims."""
