"""Which fruitlet of one picture is which of another (paper, "Growth Rate Tracking")."""
