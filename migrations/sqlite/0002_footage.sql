-- Uploaded videos. The same bytes with the same given background are the same footage; no given
-- background is the empty hash.
create table footage (
    id                blob    primary key not null check (length(id) = 16),
    folder            text    not null unique,
    sha256            blob    not null check (length(sha256) = 32),
    background_sha256 blob    not null check (length(background_sha256) in (0, 32)),
    name              text    not null,
    size_bytes        integer not null,
    width             integer not null check (width > 0),
    height            integer not null check (height > 0),
    fps               real    not null check (fps > 0),
    n_frames_hint     integer not null,
    sample            integer not null check (sample in (0, 1)),
    created_ms        integer not null,
    constraint footage_bytes unique (sha256, background_sha256)
) strict;
