-- Resumable uploads.
create table uploads (
    id           uuid   primary key,
    owner        text   not null default 'local',
    name         text   not null,
    size_bytes   bigint not null check (size_bytes >= 0),
    offset_bytes bigint not null default 0 check (offset_bytes between 0 and size_bytes),
    footage_id   uuid,
    expires_ms   bigint not null
);
create index uploads_by_age on uploads (expires_ms);
