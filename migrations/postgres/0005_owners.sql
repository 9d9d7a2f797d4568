-- Whose each thing is.
alter table footage add column owner text not null default 'local';
alter table footage drop constraint footage_bytes;
alter table footage add constraint footage_bytes unique (owner, sha256, background_sha256);
alter table jobs add column owner text not null default 'local';
alter table libraries add column owner text not null default 'local';
alter table flocks add column owner text not null default 'local';
alter table fish add column owner text not null default 'local';
create index jobs_by_owner on jobs (owner, state);
create index jobs_by_last_turn on jobs (owner, started_ms);
