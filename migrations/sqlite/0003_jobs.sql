-- The queue. The lease stands in the job's own row, so that a stalled job is found without a join;
-- the fence grows with every claim, so that a worker that was given up can change nothing.
create table jobs (
    id               blob    primary key not null check (length(id) = 16),
    kind             text    not null check (kind in ('analysis', 'flock', 'fish')),
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
    check ((state = 'running') = (lease_until_ms is not null)),
    check ((state = 'running') = (worker is not null)),
    check ((state = 'failed') = (code is not null)),
    check ((state in ('done', 'failed', 'cancelled')) = (finished_ms is not null))
) strict;
create index jobs_by_turn on jobs (state, priority desc, id);
create index jobs_by_predecessor on jobs (after_job) where after_job is not null;
