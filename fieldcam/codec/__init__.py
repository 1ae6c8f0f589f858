"""The text form of a reading, in which it crosses processes and is stored."""
