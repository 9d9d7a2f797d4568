-- Scale of a library, pixels per centimetre, which a person sets after the measurement; null until then. The limits
-- are those of `Scale`.
alter table libraries add column px_per_cm real check (px_per_cm between 0.001 and 1000000);
