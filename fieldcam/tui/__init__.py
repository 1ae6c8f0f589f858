"""Screens and widgets of the app; only this part imports Textual."""
