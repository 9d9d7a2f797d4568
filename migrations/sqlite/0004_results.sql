-- What finished jobs left: each row names its job and the fence under which the job finished, so
-- that "done if and only if exactly one result set" can be checked (RELIABILITY.md, I4).
create table libraries (
    id         blob    primary key not null check (length(id) = 16),
    job_id     blob    not null unique references jobs (id),
    fence      integer not null,
    folder     text    not null unique,
    footage_id blob    not null references footage (id),
    params     text    not null,
    summary    text    not null,
    size_bytes integer not null,
    created_ms integer not null
) strict;
create index libraries_by_footage on libraries (footage_id);

create table flocks (
    id         blob    primary key not null check (length(id) = 16),
    job_id     blob    not null unique references jobs (id),
    fence      integer not null,
    folder     text    not null unique,
    library_id blob    not null references libraries (id),
    params     text    not null,
    summary    text    not null,
    size_bytes integer not null,
    created_ms integer not null
) strict;
create index flocks_by_library on flocks (library_id);

create table fish (
    id         blob    primary key not null check (length(id) = 16),
    job_id     blob    not null unique references jobs (id),
    fence      integer not null,
    folder     text    not null unique,
    library_id blob    not null references libraries (id),
    params     text    not null,
    summary    text    not null,
    size_bytes integer not null,
    created_ms integer not null
) strict;
create index fish_by_library on fish (library_id);
