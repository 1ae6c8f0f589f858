-- Every row of every table is written once. `entry` says when, where and by whom;
-- the table that `kind` names holds the rest under the same id.
CREATE TABLE entry (
    id TEXT PRIMARY KEY,  -- UUID made by the device that wrote the row
    kind TEXT NOT NULL,
    device TEXT NOT NULL REFERENCES device (id) DEFERRABLE INITIALLY DEFERRED,
    seq INTEGER NOT NULL CHECK (seq > 0),  -- counts the device's rows without a gap
    -- One more than the largest turn that this file held: a row that was written in
    -- knowledge of another has the larger turn, whatever the clocks said.
    turn INTEGER NOT NULL,
    who TEXT REFERENCES operator (id) DEFERRABLE INITIALLY DEFERRED,  -- NULL: unknown
    why TEXT,
    at_utc TEXT NOT NULL,
    utc_offset_min INTEGER NOT NULL,
    boot TEXT NOT NULL,  -- boot_ns compares only within one start of the machine
    boot_ns INTEGER NOT NULL,
    UNIQUE (device, seq)
) STRICT;
CREATE INDEX entry_turn ON entry (turn);

CREATE TABLE device (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    machine TEXT NOT NULL,  -- hash of the machine's own id: a cloned disk has another
    name TEXT NOT NULL
) STRICT;

-- Which device this file belongs to; a file's own affair, never sent anywhere.
CREATE TABLE here (device TEXT NOT NULL REFERENCES device (id)) STRICT;

CREATE TABLE operator (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    name TEXT NOT NULL
) STRICT;

CREATE TABLE block (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    name TEXT NOT NULL,
    orchard TEXT NOT NULL,
    variety TEXT NOT NULL,
    season INTEGER NOT NULL
) STRICT;

CREATE TABLE tree (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    label TEXT NOT NULL
) STRICT;
CREATE INDEX tree_block ON tree (block);

CREATE TABLE cluster (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    tag_id INTEGER NOT NULL,
    tree TEXT REFERENCES tree (id)
) STRICT;
CREATE INDEX cluster_tag ON cluster (block, tag_id);

CREATE TABLE route (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    tag_ids TEXT NOT NULL CHECK (json_type(tag_ids) = 'array')
) STRICT;
CREATE INDEX route_block ON route (block);

CREATE TABLE block_setting (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    tree TEXT REFERENCES tree (id),  -- NULL: the whole block
    name TEXT NOT NULL,
    value REAL NOT NULL
) STRICT;
CREATE INDEX block_setting_block ON block_setting (block);

CREATE TABLE spray (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    sprayed_on TEXT NOT NULL,
    product TEXT NOT NULL,
    rate TEXT NOT NULL
) STRICT;
CREATE INDEX spray_block ON spray (block);

CREATE TABLE visit (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    block TEXT NOT NULL REFERENCES block (id),
    day TEXT NOT NULL
) STRICT;
CREATE INDEX visit_block ON visit (block, day);

CREATE TABLE capture (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    visit TEXT REFERENCES visit (id),  -- NULL: taken up from files after a crash
    tag_expected INTEGER,
    view INTEGER NOT NULL CHECK (view > 0),
    retake_of TEXT REFERENCES capture (id),
    left_file TEXT NOT NULL,  -- SHA-256 and ending; lies under objects/
    right_file TEXT NOT NULL,
    left_bytes INTEGER NOT NULL,
    right_bytes INTEGER NOT NULL,
    pixel_format TEXT NOT NULL,
    taken_at TEXT NOT NULL,
    left_timestamp_ns INTEGER NOT NULL,
    right_timestamp_ns INTEGER NOT NULL,
    left_serial TEXT NOT NULL,
    right_serial TEXT NOT NULL,
    trigger_ordinal INTEGER NOT NULL,
    simulated INTEGER NOT NULL CHECK (simulated IN (0, 1)),
    source TEXT,  -- where an imported pair came from
    calibration TEXT  -- its file under objects/; NULL: that of the camera in use
) STRICT;
CREATE INDEX capture_visit ON capture (visit);
CREATE INDEX capture_left ON capture (left_file, right_file);
CREATE INDEX capture_tag_expected ON capture (tag_expected);
CREATE INDEX capture_right ON capture (right_file);

-- Files that are kept although no capture names them: a picture without its other eye
-- after a crash, a calibration.
CREATE TABLE object_file (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    file TEXT NOT NULL,
    bytes INTEGER NOT NULL,
    role TEXT NOT NULL
) STRICT;
CREATE INDEX object_file_file ON object_file (file);

CREATE TABLE reading (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    capture TEXT NOT NULL REFERENCES capture (id),
    schema_version INTEGER NOT NULL,
    tag_read INTEGER,
    status TEXT NOT NULL,
    reasons TEXT NOT NULL CHECK (json_type(reasons) = 'array'),
    target_count INTEGER NOT NULL,
    sizes TEXT NOT NULL CHECK (json_type(sizes) = 'array'),
    models TEXT NOT NULL CHECK (json_type(models) = 'object'),
    method TEXT NOT NULL,
    stereo TEXT NOT NULL,
    software_version TEXT NOT NULL,
    duration_ms REAL NOT NULL,
    document TEXT NOT NULL  -- long, so last: reading the columns before it stays cheap
) STRICT;
CREATE INDEX reading_capture ON reading (capture);
CREATE INDEX reading_tag_read ON reading (tag_read, capture);

CREATE TABLE analysis_failure (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    capture TEXT NOT NULL REFERENCES capture (id),
    cause TEXT NOT NULL,
    message TEXT NOT NULL
) STRICT;
CREATE INDEX analysis_failure_capture ON analysis_failure (capture);

CREATE TABLE decision (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    capture TEXT NOT NULL REFERENCES capture (id),
    action TEXT NOT NULL,
    answer TEXT
) STRICT;
CREATE INDEX decision_capture ON decision (capture);

CREATE TABLE skip (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    visit TEXT NOT NULL REFERENCES visit (id),
    tag_id INTEGER NOT NULL
) STRICT;
CREATE INDEX skip_visit ON skip (visit, tag_id);

CREATE TABLE fruitlet_mark (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    mark TEXT NOT NULL,
    reading TEXT REFERENCES reading (id),
    fruitlet INTEGER,  -- NULL on a reading: one that the reading does not have
    visit TEXT REFERENCES visit (id),
    tag_id INTEGER,
    count INTEGER NOT NULL CHECK (count > 0),
    x_px REAL,
    y_px REAL,
    diameter_mm REAL,
    CHECK ((reading IS NOT NULL) <> (visit IS NOT NULL AND tag_id IS NOT NULL)),
    CHECK (fruitlet IS NULL OR (reading IS NOT NULL AND count = 1))
) STRICT;
CREATE INDEX fruitlet_mark_reading ON fruitlet_mark (reading, fruitlet);
CREATE INDEX fruitlet_mark_visit ON fruitlet_mark (visit, tag_id);

CREATE TABLE tag_correction (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    capture TEXT NOT NULL REFERENCES capture (id),
    tag_id INTEGER NOT NULL
) STRICT;
CREATE INDEX tag_correction_capture ON tag_correction (capture);
CREATE INDEX tag_correction_tag ON tag_correction (tag_id, capture);

CREATE TABLE target_correction (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    reading TEXT NOT NULL REFERENCES reading (id),
    cluster INTEGER NOT NULL
) STRICT;
CREATE INDEX target_correction_reading ON target_correction (reading);

CREATE TABLE note (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    subject TEXT REFERENCES entry (id),
    text TEXT NOT NULL
) STRICT;
CREATE INDEX note_subject ON note (subject);

CREATE TABLE event (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    event TEXT NOT NULL,
    visit TEXT REFERENCES visit (id),
    capture TEXT REFERENCES capture (id),
    tag_id INTEGER,
    tree TEXT REFERENCES tree (id)
) STRICT;
CREATE INDEX event_visit ON event (visit);
CREATE INDEX event_capture ON event (capture);

-- Undoing never touches what it undoes; undone = 0 takes the undoing back.
CREATE TABLE undo (
    id TEXT PRIMARY KEY REFERENCES entry (id),
    target TEXT NOT NULL REFERENCES entry (id),
    undone INTEGER NOT NULL CHECK (undone IN (0, 1))
) STRICT;
CREATE INDEX undo_target ON undo (target);
