-- Changes of the request that may mend a failed job: a JSON list of parameters with proposed values; null if no worker
-- told any.
alter table jobs add column mends text;
