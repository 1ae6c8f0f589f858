"""Files from elsewhere: what reading one may cost, and how that is kept."""
