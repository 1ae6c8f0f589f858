"""What goes in and out of fieldcam: images, capture folders, readings, tables."""
