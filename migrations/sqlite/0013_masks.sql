-- Masks that came with a footage; the same film with other masks is another footage. SQLite changes a constraint only by
-- making the table again; what refers to it is checked at the end of the transaction.
pragma defer_foreign_keys = on;
create table footage_before as select * from footage;
drop table footage;
create table footage (
    id                blob    primary key not null check (length(id) = 16),
    owner             text    not null default 'local',
    folder            text    not null unique,
    sha256            blob    not null check (length(sha256) = 32),
    background_sha256 blob    not null check (length(background_sha256) in (0, 32)),
    masks_sha256      blob    not null default x'' check (length(masks_sha256) in (0, 32)),
    name              text    not null,
    size_bytes        integer not null,
    width             integer not null check (width > 0),
    height            integer not null check (height > 0),
    fps               real    not null check (fps > 0),
    n_frames_hint     integer not null,
    sample            integer not null check (sample in (0, 1)),
    created_ms        integer not null,
    job_id            blob    references jobs (id),
    fence             integer,
    constraint footage_bytes unique (owner, sha256, background_sha256, masks_sha256)
) strict;
insert into footage (id, owner, folder, sha256, background_sha256, name, size_bytes, width, height, fps,
    n_frames_hint, sample, created_ms, job_id, fence)
select id, owner, folder, sha256, background_sha256, name, size_bytes, width, height, fps,
    n_frames_hint, sample, created_ms, job_id, fence
from footage_before;
drop table footage_before;
create unique index footage_by_job on footage (job_id) where job_id is not null;
