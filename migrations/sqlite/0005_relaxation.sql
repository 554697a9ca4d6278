-- Why: jobs that people wait for go before jobs that nobody waits for, and tell numbers beside words;
-- the past that a job repaired is a decision that the journal keeps, and versions carry the landmarks
-- that came of it. Decisions of kind 10 need no change of the journal: see 0004.

-- Higher first; among equals the older.
alter table jobs add column priority integer not null default 0;
-- What came of the job beside a version, opaque here.
alter table jobs add column result blob;
-- The numbers of a line, opaque here; null where it has none.
alter table job_log add column figures blob;

-- The jobs that may be next.
drop index job_unfinished;
create index job_unfinished on jobs (map_id, state, priority, position) where state in (1, 2);

-- Landmarks of versions, addressed by the BLAKE3 of their content: stored once for all versions that
-- have the same.
create table landmark_sets (
    hash  blob not null,
    -- A format byte (0 plain, 1 zstd), then the content.
    bytes blob not null,
    constraint landmark_set_hash_key primary key (hash),
    constraint landmark_set_hash_whole check (length(hash) = 32)
) strict;

-- Null where a version has no landmarks.
alter table map_versions add column landmarks_hash blob
    constraint map_version_landmarks_hash_whole
        check (landmarks_hash is null or length(landmarks_hash) = 32);
