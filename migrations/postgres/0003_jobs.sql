-- The queue.
create table jobs (
    id               uuid             primary key,
    kind             text             not null check (kind in ('analysis', 'flock', 'fish')),
    state            text             not null check (state in ('queued', 'running', 'done', 'failed', 'cancelled')),
    input            text             not null,
    result_id        uuid             not null unique,
    after_job        uuid             references jobs (id),
    priority         bigint           not null,
    run_at_ms        bigint           not null,
    attempt          bigint           not null default 0,
    crashes          bigint           not null default 0,
    fence            bigint           not null default 0,
    worker           uuid,
    lease_until_ms   bigint,
    cancel_requested boolean          not null default false,
    stage            text,
    progress         double precision not null default 0 check (progress between 0 and 1),
    code             text,
    detail           text,
    created_ms       bigint           not null,
    started_ms       bigint,
    finished_ms      bigint,
    check ((state = 'running') = (lease_until_ms is not null)),
    check ((state = 'running') = (worker is not null)),
    check ((state = 'failed') = (code is not null)),
    check ((state in ('done', 'failed', 'cancelled')) = (finished_ms is not null))
);
create index jobs_by_turn on jobs (state, priority desc, id);
create index jobs_by_predecessor on jobs (after_job) where after_job is not null;

-- What SQLite calls so: one field of a JSON text, as text.
create function json_extract(document text, path text) returns text
    language sql immutable
    return jsonb_path_query_first(document::jsonb, path::jsonpath) #>> '{}';
