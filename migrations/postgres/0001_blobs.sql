-- The files of the blob store; see the same number for SQLite for why, here and in all that follow.
create table blobs (
    folder     text   not null,
    name       text   not null,
    size_bytes bigint not null check (size_bytes >= 0),
    sha256     bytea  not null check (length(sha256) = 32),
    primary key (folder, name)
);
