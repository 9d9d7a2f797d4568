-- What was answered to requests that carried an Idempotency-Key.
create table idempotency (
    caller      text   not null,
    route       text   not null,
    key         text   not null,
    ids         uuid   not null,
    state       text   not null check (state in ('running', 'interrupted', 'done')),
    body_sha256 bytea  check (length(body_sha256) = 32),
    status      bigint check (status between 200 and 499),
    headers     text,
    answer      bytea,
    created_ms  bigint not null,
    primary key (caller, route, key),
    check ((state = 'done') = (status is not null)),
    check ((state = 'done') = (headers is not null)),
    check ((state = 'done') = (answer is not null))
);
create index idempotency_by_age on idempotency (created_ms);
