-- SHA-256 of the reading's other columns, so that damage is seen; NULL: written before.
ALTER TABLE reading ADD COLUMN sha256 TEXT;
