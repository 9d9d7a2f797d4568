-- What was answered to requests that carried an Idempotency-Key, for a day. The ids that such a request
-- may make things under are chosen before it runs and kept here: a process that dies between making
-- a thing and noting the answer makes no second one when the request comes again.
create table idempotency (
    caller      text    not null,
    route       text    not null,
    key         text    not null,
    ids         blob    not null check (length(ids) = 16),
    state       text    not null check (state in ('running', 'interrupted', 'done')),
    body_sha256 blob    check (length(body_sha256) = 32),
    status      integer check (status between 200 and 499),
    headers     text,
    answer      blob,
    created_ms  integer not null,
    primary key (caller, route, key),
    check ((state = 'done') = (status is not null)),
    check ((state = 'done') = (headers is not null)),
    check ((state = 'done') = (answer is not null))
) strict;
create index idempotency_by_age on idempotency (created_ms);
