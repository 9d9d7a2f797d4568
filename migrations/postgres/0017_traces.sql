-- Header `traceparent` (W3C Trace Context) of the request that queued the job; null if it had none.
alter table jobs add column traceparent text;
