-- Resumable uploads. The offset is what has been synced to the upload's file and, where the sender gave a
-- checksum, found right: bytes beyond it in the file are cut off before the next are taken. Once all are
-- there and admitted the file is gone and the footage's id stands here until the upload expires.
create table uploads (
    id           blob    primary key not null check (length(id) = 16),
    owner        text    not null default 'local',
    name         text    not null,
    size_bytes   integer not null check (size_bytes >= 0),
    offset_bytes integer not null default 0 check (offset_bytes between 0 and size_bytes),
    footage_id   blob    check (length(footage_id) = 16),
    expires_ms   integer not null
) strict;
create index uploads_by_age on uploads (expires_ms);
