-- Masks that came with a footage; the same film with other masks is another footage.
alter table footage add column masks_sha256 bytea not null default '' check (length(masks_sha256) in (0, 32));
alter table footage drop constraint footage_bytes;
alter table footage add constraint footage_bytes unique (owner, sha256, background_sha256, masks_sha256);
