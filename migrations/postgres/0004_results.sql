-- What finished jobs left.
create table libraries (
    id         uuid   primary key,
    job_id     uuid   not null unique references jobs (id),
    fence      bigint not null,
    folder     text   not null unique,
    footage_id uuid   not null references footage (id),
    params     text   not null,
    summary    text   not null,
    size_bytes bigint not null,
    created_ms bigint not null
);
create index libraries_by_footage on libraries (footage_id);

create table flocks (
    id         uuid   primary key,
    job_id     uuid   not null unique references jobs (id),
    fence      bigint not null,
    folder     text   not null unique,
    library_id uuid   not null references libraries (id),
    params     text   not null,
    summary    text   not null,
    size_bytes bigint not null,
    created_ms bigint not null
);
create index flocks_by_library on flocks (library_id);

create table fish (
    id         uuid   primary key,
    job_id     uuid   not null unique references jobs (id),
    fence      bigint not null,
    folder     text   not null unique,
    library_id uuid   not null references libraries (id),
    params     text   not null,
    summary    text   not null,
    size_bytes bigint not null,
    created_ms bigint not null
);
create index fish_by_library on fish (library_id);
