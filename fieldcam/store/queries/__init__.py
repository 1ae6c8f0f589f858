"""What is read out of the database, for session and screens."""
