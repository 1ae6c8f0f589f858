"""What all parts know of pictures in memory: grey, colours, mosaics, sizes."""
