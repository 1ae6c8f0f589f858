"""What each row of the database says."""
