-- What may mend a failed job, a JSON list of parameters with proposed values; null if no worker told it.
alter table jobs add column mends text;
