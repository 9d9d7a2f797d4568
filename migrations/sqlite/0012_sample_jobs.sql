-- Filming the sample is a job, and its footage is the result. SQLite changes a constraint only by making the
-- table again; references to jobs are checked at the end of the transaction.
pragma defer_foreign_keys = on;
create table jobs_before as select * from jobs;
drop table jobs;
create table jobs (
    id               blob    primary key not null check (length(id) = 16),
    kind             text    not null check (kind in ('sample', 'analysis', 'flock', 'fish')),
    state            text    not null check (state in ('queued', 'running', 'done', 'failed', 'cancelled')),
    input            text    not null,
    result_id        blob    not null unique,
    after_job        blob    references jobs (id),
    priority         integer not null,
    run_at_ms        integer not null,
    attempt          integer not null default 0,
    crashes          integer not null default 0,
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
    check ((state = 'running') = (lease_until_ms is not null)),
    check ((state = 'running') = (worker is not null)),
    check ((state = 'failed') = (code is not null)),
    check ((state in ('done', 'failed', 'cancelled')) = (finished_ms is not null))
) strict;
insert into jobs (id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, crashes, fence, worker,
    lease_until_ms, cancel_requested, stage, progress, code, detail, created_ms, started_ms, finished_ms, owner)
select id, kind, state, input, result_id, after_job, priority, run_at_ms, attempt, crashes, fence, worker,
    lease_until_ms, cancel_requested, stage, progress, code, detail, created_ms, started_ms, finished_ms, owner
from jobs_before;
drop table jobs_before;
create index jobs_by_turn on jobs (state, priority desc, id);
create index jobs_by_predecessor on jobs (after_job) where after_job is not null;
create index jobs_by_owner on jobs (owner, state);
create index jobs_by_last_turn on jobs (owner, started_ms);

-- The job and the fence that made a footage; null for an uploaded one.
alter table footage add column job_id blob references jobs (id);
alter table footage add column fence integer;
create unique index footage_by_job on footage (job_id) where job_id is not null;
