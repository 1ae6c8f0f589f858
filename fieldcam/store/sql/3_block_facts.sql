-- What a block's first row said wrongly can be said again: the last word counts.
CREATE TABLE block_facts (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    orchard TEXT NOT NULL,
    variety TEXT NOT NULL,
    season INTEGER NOT NULL
) STRICT;
CREATE INDEX block_facts_block ON block_facts (block);
