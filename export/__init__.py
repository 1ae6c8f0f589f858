"""Training of the two networks and their conversion to ONNX; never imported by fieldcam."""
