"""Files on the disk: written whole or not at all, and what an image file says of itself."""
