"""Parts of screens, and what is drawn in them."""
