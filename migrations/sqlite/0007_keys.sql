-- Keys that the service signs with, made when they are first needed.
create table keys (
    name   text primary key not null,
    secret blob not null check (length(secret) = 32)
) strict;
