"""The composition root: which camera, analysis, store and screens a walk is made of."""
