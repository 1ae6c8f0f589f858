"""Foreign formats in and out: images, capture folders, routes, tables, documents for scripts."""
