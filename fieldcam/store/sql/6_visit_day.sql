-- The day that a visit was given, as by a clock that was wrong, can be said again: the last
-- word counts.
CREATE TABLE visit_day (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    visit TEXT NOT NULL REFERENCES visit (id),
    day TEXT NOT NULL
) STRICT;
CREATE INDEX visit_day_visit ON visit_day (visit);

CREATE VIEW visit_day_now AS
SELECT visit_day.* FROM visit_day
WHERE visit_day.id = (
    SELECT other.id FROM visit_day AS other JOIN standing AS word ON word.id = other.id
    WHERE other.visit = visit_day.visit
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW visit_now AS
SELECT visit.id AS id, visit.block AS block, coalesce(said.day, visit.day) AS day
FROM visit LEFT JOIN visit_day_now AS said ON said.visit = visit.id;
