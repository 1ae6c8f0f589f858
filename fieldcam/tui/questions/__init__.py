"""What is asked on top of a screen, or before there is one."""
