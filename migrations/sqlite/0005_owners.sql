-- Whose each thing is. What was there before tokens belongs to the owner `local`, who needs none. The same
-- bytes of two owners are two footage, or the second would learn that the first has them. A constraint can
-- only be changed by making the table anew, and what refers to it is checked at the end of the transaction.
pragma defer_foreign_keys = on;
create table footage_before as select * from footage;
drop table footage;
create table footage (
    id                blob    primary key not null check (length(id) = 16),
    owner             text    not null default 'local',
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
    constraint footage_bytes unique (owner, sha256, background_sha256)
) strict;
insert into footage (id, folder, sha256, background_sha256, name, size_bytes, width, height, fps, n_frames_hint,
    sample, created_ms)
select id, folder, sha256, background_sha256, name, size_bytes, width, height, fps, n_frames_hint, sample, created_ms
from footage_before;
drop table footage_before;
alter table jobs add column owner text not null default 'local';
alter table libraries add column owner text not null default 'local';
alter table flocks add column owner text not null default 'local';
alter table fish add column owner text not null default 'local';
create index jobs_by_owner on jobs (owner, state);
create index jobs_by_last_turn on jobs (owner, started_ms);
