-- The budget of a job. own_crashes: attempts whose own process crashed; transient_ends: attempts that ended for a
-- transient reason; lone_crashes: crashes of a process that ran this job and no other. Until now, crashes counted
-- those of bystanders too. beside_crash: in the current attempt, another job of the same process was rescued.
alter table jobs rename column crashes to lone_crashes;
update jobs set lone_crashes = 0;
alter table jobs add column own_crashes bigint not null default 0;
alter table jobs add column transient_ends bigint not null default 0;
alter table jobs add column beside_crash boolean not null default false;
-- Whether the job is expected to take little time.
alter table jobs add column small boolean not null default false;
