-- Uploaded videos.
create table footage (
    id                uuid             primary key,
    folder            text             not null unique,
    sha256            bytea            not null check (length(sha256) = 32),
    background_sha256 bytea            not null check (length(background_sha256) in (0, 32)),
    name              text             not null,
    size_bytes        bigint           not null,
    width             bigint           not null check (width > 0),
    height            bigint           not null check (height > 0),
    fps               double precision not null check (fps > 0),
    n_frames_hint     bigint           not null,
    sample            boolean          not null,
    created_ms        bigint           not null,
    constraint footage_bytes unique (sha256, background_sha256)
);
