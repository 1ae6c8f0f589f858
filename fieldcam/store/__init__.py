"""The data folder: captures as the camera gave them, durable before anything else."""
