-- Which fruitlet of an earlier picture a visit does not show, and why; how many there are
-- is said by the marks on the cluster.
CREATE TABLE missing_word (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    visit TEXT NOT NULL REFERENCES visit (id),
    tag_id INTEGER NOT NULL,
    reading TEXT NOT NULL REFERENCES reading (id),
    fruitlet INTEGER NOT NULL,
    answer TEXT NOT NULL
) STRICT;
CREATE INDEX missing_word_visit ON missing_word (visit, tag_id);
