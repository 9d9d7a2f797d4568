-- The frames that show why a film was refused, JPEG.
alter table jobs add column refused_jpeg blob;
