-- The files of the blob store. A row exists only for a file that is already in its place and synced;
-- a file without a row is a leftover and is swept (RELIABILITY.md, store rules).
create table blobs (
    folder     text    not null,
    name       text    not null,
    size_bytes integer not null check (size_bytes >= 0),
    sha256     blob    not null check (length(sha256) = 32),
    primary key (folder, name)
) strict;
