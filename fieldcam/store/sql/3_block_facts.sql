-- What a block's first row said wrongly can be said again: the last word counts.
CREATE TABLE block_facts (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    orchard TEXT NOT NULL,
    variety TEXT NOT NULL,
    season INTEGER NOT NULL
) STRICT;
CREATE INDEX block_facts_block ON block_facts (block);

CREATE VIEW block_now AS
SELECT
    block.id AS id,
    block.name AS name,
    coalesce(facts.orchard, block.orchard) AS orchard,
    coalesce(facts.variety, block.variety) AS variety,
    coalesce(facts.season, block.season) AS season
FROM block LEFT JOIN block_facts AS facts ON facts.id = (
    SELECT other.id FROM block_facts AS other JOIN standing AS word ON word.id = other.id
    WHERE other.block = block.id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);
