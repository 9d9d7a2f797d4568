-- Data sets, made from several libraries. Each finished flock of a data set is a part, which is stored while the job runs
-- and stays when an attempt ends. A part is a folder of files.
alter table jobs drop constraint jobs_kind_check;
alter table jobs add constraint jobs_kind_check
    check (kind in ('sample', 'analysis', 'views', 'flock', 'fish', 'dataset'));

-- Has the columns of flocks and fish, so that the same statements serve all results of libraries. library_id is the first
-- of the libraries; the input of the job names all.
create table datasets (
    id         uuid    primary key,
    job_id     uuid    not null unique references jobs (id),
    fence      bigint  not null,
    folder     text    not null unique,
    library_id uuid    not null references libraries (id),
    params     text    not null,
    summary    text    not null,
    size_bytes bigint  not null,
    created_ms bigint  not null,
    owner      text    not null,
    pinned     boolean not null default false,
    used_ms    bigint  not null
);
create index datasets_by_library on datasets (library_id);
create index datasets_by_owner on datasets (owner, size_bytes);

create table job_parts (
    job_id     uuid    not null references jobs (id),
    number     bigint  not null,
    folder     text    not null unique,
    size_bytes bigint  not null,
    owner      text    not null,
    primary key (job_id, number)
);
create index job_parts_by_owner on job_parts (owner, size_bytes);
