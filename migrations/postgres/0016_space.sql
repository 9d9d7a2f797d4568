-- When each resource was last used, and whether it stays even if nobody uses it. Uses before this version are
-- unknown, so older resources count as used now.
alter table footage add column pinned boolean not null default false;
alter table libraries add column pinned boolean not null default false;
alter table flocks add column pinned boolean not null default false;
alter table fish add column pinned boolean not null default false;
alter table footage add column used_ms bigint not null default 0;
alter table libraries add column used_ms bigint not null default 0;
alter table flocks add column used_ms bigint not null default 0;
alter table fish add column used_ms bigint not null default 0;
update footage set used_ms = cast(extract(epoch from now()) * 1000 as bigint);
update libraries set used_ms = cast(extract(epoch from now()) * 1000 as bigint);
update flocks set used_ms = cast(extract(epoch from now()) * 1000 as bigint);
update fish set used_ms = cast(extract(epoch from now()) * 1000 as bigint);

-- The sum of an owner's bytes reads only these indexes.
create index footage_by_owner on footage (owner, size_bytes);
create index libraries_by_owner on libraries (owner, size_bytes);
create index flocks_by_owner on flocks (owner, size_bytes);
create index fish_by_owner on fish (owner, size_bytes);
create index uploads_by_owner on uploads (owner, size_bytes) where footage_id is null;

-- What SQLite calls so: the hexadecimal digits of an id, in upper case.
create function hex(id uuid) returns text
    language sql immutable
    return upper(replace(cast(id as text), '-', ''));
