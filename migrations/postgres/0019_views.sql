-- The views of a library (film.mp4, overlay.mp4) are the result of a job of their own, which the service queues when
-- the library is done. Libraries of older versions have them in their own folder and no such job.
alter table jobs drop constraint jobs_kind_check;
alter table jobs add constraint jobs_kind_check check (kind in ('sample', 'analysis', 'views', 'flock', 'fish'));

-- Has the columns of flocks and fish, so that the same statements serve all results of libraries.
create table views (
    id         uuid    primary key,
    job_id     uuid    not null unique references jobs (id),
    fence      bigint  not null,
    folder     text    not null unique,
    library_id uuid    not null unique references libraries (id),
    params     text    not null,
    summary    text    not null,
    size_bytes bigint  not null,
    created_ms bigint  not null,
    owner      text    not null,
    pinned     boolean not null default false,
    used_ms    bigint  not null
);
create index views_by_owner on views (owner, size_bytes);
