-- Who may ask.
create table tokens (
    id         text   primary key,
    name       text   not null,
    owner      text   not null,
    sha256     bytea  not null check (length(sha256) = 32),
    scope      text   not null check (scope in ('read', 'write', 'admin')),
    quota      bigint not null check (quota >= 0),
    created_ms bigint not null,
    expires_ms bigint,
    revoked_ms bigint
);

create table sessions (
    sha256     bytea  primary key check (length(sha256) = 32),
    token_id   text   not null references tokens (id),
    created_ms bigint not null,
    expires_ms bigint not null
);
