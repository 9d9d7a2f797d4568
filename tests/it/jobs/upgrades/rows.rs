//! Rows as older versions wrote them, one text for each schema. A database at schema N has the rows of all texts up to N.
//! A new migration that adds a table or a column gets a text here; other migrations need none.
//!
//! `@N` stands for the id with this number, `#film` for the SHA-256 of a stored file, `@true` and `@false` for booleans.

/// Content of every stored film.
pub(super) const FILM: &[u8] = b"a film of an older version";
/// Content of every stored library.json, flock.json, video.mp4.
pub(super) const RESULT: &[u8] = b"{}";
/// Bytes of an unfinished upload, confirmed to the sender.
pub(super) const UPLOADED: &[u8] = b"half of a film";
/// Token of the owner `ann`.
pub(super) const TOKEN: &str = "frl_00000000ann_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQ";
/// Secret that signs links.
pub(super) const LINK_KEY: [u8; 32] = [7; 32];

/// Stored files: schema that has their row first, folder, name and content.
pub(super) const FILES: [(i64, &str, &str, &[u8]); 11] = [
    (2, "footage/1", "video", FILM),
    (4, "libraries/13", "library.json", RESULT),
    (4, "libraries/13", "film.mp4", RESULT),
    (4, "flocks/15", "flock.json", RESULT),
    (4, "fish/17", "video.mp4", RESULT),
    (5, "footage/2", "video", FILM),
    (12, "footage/3", "video", FILM),
    (13, "footage/4", "video", FILM),
    (19, "views/70", "film.mp4", FILM),
    (21, "datasets/80", "manifest.json", RESULT),
    (21, "datasets/82", "entries", RESULT),
];

/// Schema and rows.
pub(super) const ROWS: [(i64, &str); 17] = [
    (1, ""), // The rows of the stored files follow from FILES.
    (
        2,
        "insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, height, fps, n_frames_hint,
            sample, created_ms) values (@1, 'footage/1', #film, #none, 'old film', 26, 64, 48, 25.0, 10, @false, 1000);",
    ),
    (
        3,
        "insert into jobs (id, kind, state, input, result_id, priority, run_at_ms, attempt, fence, worker,
            lease_until_ms, code, detail, created_ms, started_ms, finished_ms) values
            (@20, 'analysis', 'queued', '{\"footage_id\": \"@uuid1\", \"params\": {}}', @30, 0, 0, 0, 0, null, null, null,
                null, 5000, null, null),
            (@21, 'analysis', 'failed', '{}', @31, 0, 0, 1, 1, null, null, 'nothing_moves', 'Nothing moves.', 5000, 5001,
                5002),
            (@22, 'analysis', 'cancelled', '{}', @32, 0, 0, 0, 0, null, null, null, null, 5000, null, 5003),
            (@23, 'analysis', 'running', '{\"footage_id\": \"@uuid1\", \"params\": {}}', @33, 0, 0, 1, 1, @99, 6000, null,
                null, 5000, 5001, null);",
    ),
    (
        4,
        "insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, fence, created_ms,
            started_ms, finished_ms) values
            (@12, 'analysis', 'done', '{}', @13, null, 0, 0, 1, 1, 2000, 2001, 2002),
            (@14, 'flock', 'done', '{}', @15, @12, 0, 0, 1, 1, 3000, 3001, 3002),
            (@16, 'fish', 'done', '{}', @17, @12, 0, 0, 1, 1, 4000, 4001, 4002);
        insert into libraries (id, job_id, fence, folder, footage_id, params, summary, size_bytes, created_ms) values
            (@13, @12, 1, 'libraries/13', @1, '{}', '{\"fps\": 25.0, \"image_size_px\": [64, 48], \"view\": \"side\",
            \"n_frames\": 10, \"detected_share\": 1.0, \"n_transitions\": 1, \"component_share\": 1.0, \"clip_frames\": 4,
            \"length_px\": null}', 4, 2002);
        insert into flocks (id, job_id, fence, folder, library_id, params, summary, size_bytes, created_ms) values
            (@15, @14, 1, 'flocks/15', @13, '{}', '{\"fps\": 25.0, \"image_size_px\": [64, 48], \"count\": 4,
            \"frames\": 24, \"seed\": 1}', 2, 3002);
        insert into fish (id, job_id, fence, folder, library_id, params, summary, size_bytes, created_ms) values
            (@17, @16, 1, 'fish/17', @13, '{}', '{\"fps\": 25.0, \"image_size_px\": [64, 48], \"frames\": 10,
            \"visible_frames\": 10}', 2, 4002);",
    ),
    (
        5,
        "insert into footage (id, owner, folder, sha256, background_sha256, name, size_bytes, width, height, fps,
            n_frames_hint, sample, created_ms) values (@2, 'ann', 'footage/2', #film, #none, 'film of ann', 26, 64, 48,
            25.0, 10, @false, 1001);
        insert into jobs (id, owner, kind, state, input, result_id, priority, run_at_ms, attempt, fence, code, detail,
            created_ms, started_ms, finished_ms) values
            (@24, 'ann', 'flock', 'failed', '{}', @34, 0, 0, 1, 1, 'internal', 'Failed.', 5000, 5001, 5002);",
    ),
    (
        6,
        "insert into tokens (id, name, owner, sha256, scope, quota, created_ms) values
            ('00000000ann', 'laptop', 'ann', #secret, 'write', 5, 0);
        insert into sessions (sha256, token_id, created_ms, expires_ms) values (#cookie, '00000000ann', 0, 99999999999999);",
    ),
    (
        7,
        "insert into keys (name, secret) values ('links', #link_key);",
    ),
    (
        10,
        "insert into idempotency (caller, route, key, ids, state, body_sha256, status, headers, answer, created_ms) values
            ('local', '/v1/fish', 'old', @40, 'done', #body, 202, '[[\"content-type\",\"application/json\"]]', #answer,
                @now),
            ('local', '/v1/fish', 'broken', @41, 'interrupted', #body, null, null, null, @now);",
    ),
    (
        11,
        "insert into uploads (id, owner, name, size_bytes, offset_bytes, expires_ms) values
            (@50, 'local', 'half', 100, 14, 99999999999999);",
    ),
    (
        12,
        "insert into jobs (id, kind, state, input, result_id, priority, run_at_ms, attempt, fence, created_ms, started_ms,
            finished_ms) values (@60, 'sample', 'done', '{}', @3, 0, 0, 1, 1, 7000, 7001, 7002);
        insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, height, fps, n_frames_hint,
            sample, created_ms, job_id, fence) values (@3, 'footage/3', #film, #film, 'sample', 26, 64, 48, 25.0, 10, @true,
            7002, @60, 1);",
    ),
    (
        13,
        "insert into footage (id, folder, sha256, background_sha256, masks_sha256, name, size_bytes, width, height, fps,
            n_frames_hint, sample, created_ms) values (@4, 'footage/4', #film, #none, #film, 'film with masks', 26, 64, 48,
            25.0, 10, @false, 1002);",
    ),
    (
        14,
        "update jobs set refused_jpeg = #jpeg where id = @21;",
    ),
    (
        17,
        "update jobs set traceparent = '00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01' where id = @21;",
    ),
    (
        18,
        "update libraries set px_per_cm = 42.5 where id = @13;",
    ),
    (
        19,
        "insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, fence, created_ms,
            started_ms, finished_ms) values
            (@71, 'views', 'done', '{\"library_id\": \"@uuid13\"}', @70, @12, -1, 0, 1, 1, 2002, 2003, 2004);
        insert into views (id, job_id, fence, folder, library_id, params, summary, size_bytes, created_ms, owner, used_ms)
            values (@70, @71, 1, 'views/70', @13, '{}', '{}', 26, 2004, 'local', 2004);",
    ),
    (
        20,
        "update jobs set mends = '[]' where id = @21;",
    ),
    (
        21,
        "insert into jobs (id, kind, state, input, result_id, priority, run_at_ms, attempt, fence, created_ms, started_ms,
            finished_ms) values
            (@81, 'dataset', 'done', '{\"library_ids\": [\"@uuid13\"]}', @80, 0, 0, 1, 1, 8000, 8001, 8002);
        insert into datasets (id, job_id, fence, folder, library_id, params, summary, size_bytes, created_ms, owner, used_ms)
            values (@80, @81, 1, 'datasets/80', @13, '{}', '{\"library_ids\": [\"@uuid13\"],
            \"flocks\": 1, \"pictures\": 1, \"licence\": null, \"source\": null}', 2, 8002, 'local', 8002);
        insert into job_parts (job_id, number, folder, size_bytes, owner)
            values (@81, 0, 'datasets/82', 2, 'local');",
    ),
];
