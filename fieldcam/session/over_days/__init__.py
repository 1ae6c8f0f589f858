"""Clusters and blocks over the days, and what growth makes of them."""
