-- A size comes with its standard deviation; NULL: the reading did not say.
DROP VIEW fruitlet_now;

-- The fruitlets of each capture's last reading, with corrections and marks applied.
CREATE VIEW fruitlet_now AS
SELECT
    reading.id AS reading,
    reading.capture AS capture,
    json_extract(size.value, '$.id') AS fruitlet,
    json_extract(size.value, '$.cluster') AS cluster,
    json_extract(size.value, '$.diameter_mm') AS diameter_mm,
    json_extract(size.value, '$.sd_mm') AS sd_mm,
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
