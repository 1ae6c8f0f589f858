-- Among rows about the same thing the last one counts: the largest turn, and where two
-- devices did not know of each other the later clock. The id only settles ties.

-- Rows that were not undone.
CREATE VIEW standing AS
SELECT * FROM entry
WHERE coalesce((
    SELECT undo.undone FROM undo JOIN entry AS word ON word.id = undo.id
    WHERE undo.target = entry.id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
), 0) = 0;

CREATE VIEW decision_now AS
SELECT decision.*, standing.turn FROM decision JOIN standing ON standing.id = decision.id
WHERE decision.id = (
    SELECT other.id FROM decision AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = decision.capture
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW tag_correction_now AS
SELECT tag_correction.* FROM tag_correction
WHERE tag_correction.id = (
    SELECT other.id FROM tag_correction AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = tag_correction.capture
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW target_correction_now AS
SELECT target_correction.* FROM target_correction
WHERE target_correction.id = (
    SELECT other.id FROM target_correction AS other JOIN standing AS word ON word.id = other.id
    WHERE other.reading = target_correction.reading
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW reading_now AS
SELECT reading.* FROM reading
WHERE reading.id = (
    SELECT other.id FROM reading AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = reading.capture
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW cluster_now AS
SELECT cluster.*, standing.turn FROM cluster JOIN standing ON standing.id = cluster.id
WHERE cluster.id = (
    SELECT other.id FROM cluster AS other JOIN standing AS word ON word.id = other.id
    WHERE other.block = cluster.block AND other.tag_id = cluster.tag_id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW route_now AS
SELECT route.*, standing.turn FROM route JOIN standing ON standing.id = route.id
WHERE route.id = (
    SELECT other.id FROM route AS other JOIN standing AS word ON word.id = other.id
    WHERE other.block = route.block
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW block_setting_now AS
SELECT block_setting.* FROM block_setting
WHERE block_setting.id = (
    SELECT other.id FROM block_setting AS other JOIN standing AS word ON word.id = other.id
    WHERE other.block = block_setting.block AND other.tree IS block_setting.tree
        AND other.name = block_setting.name
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

CREATE VIEW fruitlet_mark_now AS
SELECT fruitlet_mark.*, standing.turn
FROM fruitlet_mark JOIN standing ON standing.id = fruitlet_mark.id;

-- The fruitlets of each capture's last reading, with corrections and marks applied.
CREATE VIEW fruitlet_now AS
SELECT
    reading.id AS reading,
    reading.capture AS capture,
    json_extract(size.value, '$.id') AS fruitlet,
    json_extract(size.value, '$.cluster') AS cluster,
    json_extract(size.value, '$.diameter_mm') AS diameter_mm,
    coalesce(
        (
            SELECT target.cluster IS json_extract(size.value, '$.cluster')
            FROM target_correction_now AS target WHERE target.reading = reading.id
        ),
        json_extract(size.value, '$.in_target')
    ) AS in_target,
    NOT EXISTS (
        SELECT 1 FROM fruitlet_mark_now AS mark
        WHERE mark.reading = reading.id
            AND mark.fruitlet = json_extract(size.value, '$.id')
            AND mark.mark IN ('fallen', 'not_a_fruitlet')
    ) AS living
FROM reading_now AS reading, json_each(reading.sizes) AS size;

-- An accepted picture belongs to the tag that it shows, any other one to the tag that
-- was asked for: a picture of the wrong tag must not end the search for the right one.
-- (Joining the views above would cost a scan of each.)
CREATE VIEW capture_now AS
SELECT
    capture.*,
    entry.turn AS turn,
    reading.id AS reading,
    decision.id AS decision,
    decision.action AS action,
    coalesce(
        tag_correction.tag_id,
        CASE decision.action WHEN 'accept' THEN reading.tag_read END,
        capture.tag_expected,
        reading.tag_read
    ) AS tag_id
FROM capture
JOIN entry ON entry.id = capture.id
LEFT JOIN reading ON reading.id = (
    SELECT other.id FROM reading AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = capture.id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
)
LEFT JOIN decision ON decision.id = (
    SELECT other.id FROM decision AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = capture.id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
)
LEFT JOIN tag_correction ON tag_correction.id = (
    SELECT other.id FROM tag_correction AS other JOIN standing AS word ON word.id = other.id
    WHERE other.capture = capture.id
    ORDER BY word.turn DESC, word.at_utc DESC, word.id DESC LIMIT 1
);

-- The captures that may belong to a tag; looking only at these spares looking at all.
CREATE VIEW tag_candidate AS
SELECT tag_expected AS tag_id, id AS capture FROM capture
UNION ALL SELECT tag_read, capture FROM reading
UNION ALL SELECT tag_id, capture FROM tag_correction;

-- Living fruitlets of the target cluster that a capture shows.
CREATE VIEW count_now AS
SELECT
    reading.capture AS capture,
    (
        SELECT count(*) FROM fruitlet_now AS fruitlet
        WHERE fruitlet.capture = reading.capture AND fruitlet.in_target AND fruitlet.living
    ) + (
        SELECT coalesce(sum(mark.count), 0) FROM fruitlet_mark_now AS mark
        WHERE mark.reading = reading.id AND mark.fruitlet IS NULL AND mark.mark = 'added_by_hand'
    ) AS living
FROM reading_now AS reading;
