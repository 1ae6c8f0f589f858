"""Full screens of the app, and what only they share."""
