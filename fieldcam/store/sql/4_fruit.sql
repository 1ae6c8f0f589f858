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
