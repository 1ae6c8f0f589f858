-- What is said of single fruit: their sizes by caliper, their names, and which fruitlet of
-- one picture is which of another.
CREATE TABLE caliper_size (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    tag_id INTEGER NOT NULL,
    day TEXT NOT NULL,
    fruit TEXT NOT NULL CHECK (fruit <> ''),
    diameter_mm REAL NOT NULL CHECK (diameter_mm > 0),
    source TEXT  -- the file that it came from; NULL: typed at the tag
) STRICT;
CREATE INDEX caliper_size_fruit ON caliper_size (block, tag_id, day, fruit);

CREATE TABLE caliper_identity (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    reading TEXT NOT NULL REFERENCES reading (id),
    fruitlet INTEGER NOT NULL,
    fruit TEXT NOT NULL CHECK (fruit <> '')
) STRICT;
CREATE INDEX caliper_identity_reading ON caliper_identity (reading);

CREATE TABLE association_word (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    one_reading TEXT NOT NULL REFERENCES reading (id),
    one_fruitlet INTEGER NOT NULL,
    other_reading TEXT NOT NULL REFERENCES reading (id),
    other_fruitlet INTEGER,  -- NULL: the other reading does not show it
    CHECK (one_reading <> other_reading)
) STRICT;
CREATE INDEX association_word_one ON association_word (one_reading, other_reading);
CREATE INDEX association_word_other ON association_word (other_reading, one_reading);

CREATE VIEW caliper_size_now AS
SELECT caliper_size.* FROM caliper_size
WHERE caliper_size.id = (
    SELECT other.id FROM caliper_size AS other JOIN standing AS word ON word.id = other.id
    WHERE other.block = caliper_size.block AND other.tag_id = caliper_size.tag_id
        AND other.day = caliper_size.day AND other.fruit = caliper_size.fruit
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

-- A fruitlet has one name and a name one fruitlet: a later word about either counts.
CREATE VIEW caliper_identity_now AS
SELECT said.* FROM caliper_identity AS said JOIN standing USING (id)
WHERE NOT EXISTS (
    SELECT 1 FROM caliper_identity AS other JOIN standing AS word ON word.id = other.id
    WHERE other.reading = said.reading
        AND (other.fruitlet = said.fruitlet OR other.fruit = said.fruit)
        AND (word.turn, word.at_utc, word.id) > (standing.turn, standing.at_utc, standing.id)
);

-- Matches of two readings are one to one, whichever of them is named first.
CREATE VIEW association_word_now AS
SELECT said.*, standing.turn FROM association_word AS said JOIN standing USING (id)
WHERE NOT EXISTS (
    SELECT 1 FROM association_word AS other JOIN standing AS word ON word.id = other.id
    WHERE (
        (
            other.one_reading = said.one_reading AND other.other_reading = said.other_reading
            AND (
                other.one_fruitlet = said.one_fruitlet
                OR other.other_fruitlet = said.other_fruitlet
            )
        ) OR (
            other.one_reading = said.other_reading AND other.other_reading = said.one_reading
            AND (
                other.one_fruitlet = said.other_fruitlet
                OR other.other_fruitlet = said.one_fruitlet
            )
        )
    )
    AND (word.turn, word.at_utc, word.id) > (standing.turn, standing.at_utc, standing.id)
);
