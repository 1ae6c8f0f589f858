"""From a fruitlet's mask and disparity to its diameter, and how sure that is."""
