-- Keys that the service signs with.
create table keys (
    name   text  primary key,
    secret bytea not null check (length(secret) = 32)
);
