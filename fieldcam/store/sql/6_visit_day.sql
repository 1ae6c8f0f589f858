-- The day that a visit was given, as by a clock that was wrong, can be said again: the last
-- word counts.
CREATE TABLE visit_day (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    visit TEXT NOT NULL REFERENCES visit (id),
    day TEXT NOT NULL
) STRICT;
CREATE INDEX visit_day_visit ON visit_day (visit);
