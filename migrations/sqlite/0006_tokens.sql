-- Who may ask. Of a secret only its SHA-256 is kept: 256 random bits need no slower hash. A session is a
-- browser's stand-in for a token and ends with it.
create table tokens (
    id         text    primary key not null,
    name       text    not null,
    owner      text    not null,
    sha256     blob    not null check (length(sha256) = 32),
    scope      text    not null check (scope in ('read', 'write', 'admin')),
    quota      integer not null check (quota >= 0),
    created_ms integer not null,
    expires_ms integer,
    revoked_ms integer
) strict;

create table sessions (
    sha256     blob    primary key not null check (length(sha256) = 32),
    token_id   text    not null references tokens (id),
    created_ms integer not null,
    expires_ms integer not null
) strict;
