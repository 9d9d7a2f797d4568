-- Data sets, made from several libraries. Each finished flock of a data set is a part, which is stored while the job runs
-- and stays when an attempt ends. A part is a folder of files. SQLite changes a constraint only by making the table
-- again; references to jobs are checked at the end of the transaction.
pragma defer_foreign_keys = on;
create table jobs_before as select * from jobs;
drop table jobs;
create table jobs (
    id               blob    primary key not null check (length(id) = 16),
    kind             text    not null check (kind in ('sample', 'analysis', 'views', 'flock', 'fish', 'dataset')),
    state            text    not null check (state in ('queued', 'running', 'done', 'failed', 'cancelled')),
    input            text    not null,
    result_id        blob    not null unique,
    after_job        blob    references jobs (id),
    priority         integer not null,
    run_at_ms        integer not null,
    attempt          integer not null default 0,
    lone_crashes     integer not null default 0,
    fence            integer not null default 0,
    worker           blob,
    lease_until_ms   integer,
    cancel_requested integer not null default 0 check (cancel_requested in (0, 1)),
    stage            text,
    progress         real    not null default 0 check (progress between 0 and 1),
    code             text,
    detail           text,
    created_ms       integer not null,
    started_ms       integer,
    finished_ms      integer,
    owner            text    not null default 'local',
    refused_jpeg     blob,
    own_crashes      integer not null default 0,
    transient_ends   integer not null default 0,
    beside_crash     integer not null default 0 check (beside_crash in (0, 1)),
    small            integer not null default 0 check (small in (0, 1)),
    traceparent      text,
    mends            text,
    check ((state = 'running') = (lease_until_ms is not null)),
    check ((state = 'running') = (worker is not null)),
    check ((state = 'failed') = (code is not null)),
    check ((state in ('done', 'failed', 'cancelled')) = (finished_ms is not null))
) strict;
insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, lone_crashes, fence, worker,
    lease_until_ms, cancel_requested, stage, progress, code, detail, created_ms, started_ms, finished_ms, owner,
    refused_jpeg, own_crashes, transient_ends, beside_crash, small, traceparent, mends)
select id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, lone_crashes, fence, worker,
    lease_until_ms, cancel_requested, stage, progress, code, detail, created_ms, started_ms, finished_ms, owner,
    refused_jpeg, own_crashes, transient_ends, beside_crash, small, traceparent, mends
from jobs_before;
drop table jobs_before;
create index jobs_by_turn on jobs (state, priority desc, id);
create index jobs_by_predecessor on jobs (after_job) where after_job is not null;
create index jobs_by_owner on jobs (owner, state);
create index jobs_by_last_turn on jobs (owner, started_ms);

-- Has the columns of flocks and fish, so that the same statements serve all results of libraries. library_id is the first
-- of the libraries; the input of the job names all.
create table datasets (
    id         blob    primary key not null check (length(id) = 16),
    job_id     blob    not null unique references jobs (id),
    fence      integer not null,
    folder     text    not null unique,
    library_id blob    not null references libraries (id),
    params     text    not null,
    summary    text    not null,
    size_bytes integer not null,
    created_ms integer not null,
    owner      text    not null,
    pinned     integer not null default 0 check (pinned in (0, 1)),
    used_ms    integer not null
) strict;
create index datasets_by_library on datasets (library_id);
create index datasets_by_owner on datasets (owner, size_bytes);

create table job_parts (
    job_id     blob    not null references jobs (id),
    number     integer not null,
    folder     text    not null unique,
    size_bytes integer not null,
    owner      text    not null,
    primary key (job_id, number)
) strict;
create index job_parts_by_owner on job_parts (owner, size_bytes);
