"""What is set up before a walk."""
