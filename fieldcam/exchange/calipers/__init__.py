"""Sizes by calipers as tables: what people keep is read, and a block is written."""
