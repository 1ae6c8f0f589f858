"""Camera against calipers: the tables of the paper's "Experiments". Pure."""
