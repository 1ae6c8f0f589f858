"""What fieldcam uses of embreex."""
