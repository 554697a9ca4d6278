-- Why: what is computed from the journal is kept as immutable map versions, so that a query never
-- sees half of one, and a restart goes on from the newest instead of reading the whole journal.
-- Every row here can be computed again from the journal, except which version a person published,
-- which is in the journal too.

-- 0: no version yet.
alter table maps add column published_version integer not null default 0
    constraint map_published_version_counts check (0 <= published_version);
alter table maps add column latest_version integer not null default 0
    constraint map_latest_version_counts check (0 <= latest_version);
-- 0 while a person has moved the pointer back.
alter table maps add column publishes_automatically integer not null default 1
    constraint map_publishes_automatically_is_bool check (publishes_automatically in (0, 1));
alter table maps add column cost_revision integer not null default 0
    constraint map_cost_revision_counts check (0 <= cost_revision);

-- Pieces of grids, addressed by the BLAKE3 of their content: a tile that did not change is stored
-- once for all versions.
create table tiles (
    hash  blob not null,
    -- A format byte (0 plain, 1 zstd), then the content.
    bytes blob not null,
    constraint tile_hash_key primary key (hash),
    constraint tile_hash_whole check (length(hash) = 32)
) strict;

create table map_versions (
    map_id         text    not null,
    number         integer not null,
    -- The version tells everything up to this journal entry.
    journal_seq    integer not null,
    n_scans        integer not null,
    -- Extent of the observed cells in the map's frame: all four, or none if nothing was observed.
    x_min_m        real,
    y_min_m        real,
    x_max_m        real,
    y_max_m        real,
    -- What made it: `tracking` or a job's kind.
    origin         text    not null,
    create_time_ns integer not null,
    -- The tiles, complete: a format byte, then as storage/src/manifest.rs says.
    manifest       blob    not null,
    constraint map_version_key primary key (map_id, number),
    constraint map_version_map_exists foreign key (map_id) references maps (id),
    constraint map_version_number_positive check (0 < number),
    constraint map_version_bounds_whole check (
        (x_min_m is null) = (y_min_m is null)
        and (x_min_m is null) = (x_max_m is null)
        and (x_min_m is null) = (y_max_m is null)
    )
) strict;

-- One line of poses of one session. Only grows; a revised past is another trajectory.
create table trajectories (
    id         integer not null,
    session_id blob    not null,
    -- 1 odometry, 2 tracking, 3 relaxation.
    origin     integer not null,
    constraint trajectory_key primary key (id autoincrement),
    constraint trajectory_session_exists foreign key (session_id) references sessions (id),
    constraint trajectory_origin_known check (origin between 1 and 3)
) strict;

create table trajectory_chunks (
    trajectory_id integer not null,
    -- Index of the first pose, from 0. Chunks follow each other without gaps.
    first_index   integer not null,
    n_poses       integer not null,
    -- A format byte, then as storage/src/pose_chunk.rs says.
    poses         blob    not null,
    constraint trajectory_chunk_key primary key (trajectory_id, first_index),
    constraint trajectory_chunk_trajectory_exists
        foreign key (trajectory_id) references trajectories (id),
    constraint trajectory_chunk_counts check (0 <= first_index and 0 < n_poses)
) strict;

-- Which trajectory a session has from this version on: its first n_poses poses. Written only
-- where something changed; a version without a row goes by the newest row before it.
create table version_trajectories (
    session_id    blob    not null,
    number        integer not null,
    map_id        text    not null,
    trajectory_id integer not null,
    n_poses       integer not null,
    constraint version_trajectory_key primary key (session_id, number),
    constraint version_trajectory_version_exists
        foreign key (map_id, number) references map_versions (map_id, number),
    constraint version_trajectory_session_exists foreign key (session_id) references sessions (id),
    constraint version_trajectory_trajectory_exists
        foreign key (trajectory_id) references trajectories (id),
    constraint version_trajectory_counts check (0 <= n_poses)
) strict, without rowid;

-- Where mapping goes on after a restart: one a map.
create table checkpoints (
    map_id      text    not null,
    version     integer not null,
    journal_seq integer not null,
    -- The tracker's own state, opaque here.
    state       blob    not null,
    constraint checkpoint_key primary key (map_id),
    constraint checkpoint_version_exists
        foreign key (map_id, version) references map_versions (map_id, number)
) strict;

-- Which process maps. The fence counts up with every change of hands, and every write of the
-- holder is checked against it.
create table map_leases (
    map_id         text    not null,
    -- Null when nobody holds it.
    owner          blob,
    fence          integer not null,
    expire_time_ns integer not null,
    constraint map_lease_key primary key (map_id),
    constraint map_lease_map_exists foreign key (map_id) references maps (id),
    constraint map_lease_owner_is_uuid check (owner is null or length(owner) = 16)
) strict, without rowid;
