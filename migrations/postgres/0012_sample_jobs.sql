-- Filming the sample is a job, and its footage is the result.
alter table jobs drop constraint jobs_kind_check;
alter table jobs add constraint jobs_kind_check check (kind in ('sample', 'analysis', 'flock', 'fish'));
alter table footage add column job_id uuid references jobs (id);
alter table footage add column fence bigint;
create unique index footage_by_job on footage (job_id) where job_id is not null;
