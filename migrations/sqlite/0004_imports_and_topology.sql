-- Why: a fleet brings maps that it has, which is a decision that the journal keeps with its content;
-- and a version carries the regions and the graph of its grid, with ids that last.

-- SQLite cannot change a constraint: the journal is copied. From kind 8 on entries are decisions on
-- a map: no session, no number, and a payload that its hash is checked against. A later kind of
-- decision needs no copy.
create table journal_with_decisions (
    -- Commit order over all maps. Never used twice, even if entries should once be removed.
    seq             integer not null,
    map_id          text    not null,
    -- 1 map created, 2 session opened, 3 batch, 4 skip, 5 session closed, 6 session fenced,
    -- 7 version published, 8 map imported.
    kind            integer not null,
    session_id      blob,
    -- A batch's number, a skip's first number, a version's number.
    number          integer,
    -- A batch's number again, a skip's last number.
    through         integer,
    receive_time_ns integer not null,
    -- BLAKE3 of the payload.
    content_hash    blob,
    -- What of a batch will not be used: [{"index":0,"code":"...","detail":"..."}], or null.
    rejections      text,
    -- A skip's reason, for people.
    reason          text,
    -- Last, because it is long and the columns before it are often read alone.
    payload         blob,
    constraint journal_seq_key primary key (seq autoincrement),
    constraint journal_map_exists foreign key (map_id) references maps (id),
    constraint journal_session_exists foreign key (session_id) references sessions (id),
    constraint journal_kind_known check (0 < kind),
    constraint journal_session_named check ((session_id is null) = (kind in (1, 7) or 8 <= kind)),
    constraint journal_number_given check (
        (number is null) = (kind in (1, 2, 5, 6) or 8 <= kind)
    ),
    constraint journal_range_ordered check (
        (through is null) = (kind not in (3, 4)) and (through is null or number <= through)
    ),
    constraint journal_payload_hashed check (
        (payload is null) = (kind <> 3 and kind < 8)
        and (content_hash is null) = (payload is null)
        and (content_hash is null or length(content_hash) = 32)
    ),
    constraint journal_reason_given check ((reason is null) = (kind <> 4))
) strict;

insert into journal_with_decisions (seq, map_id, kind, session_id, number, through,
        receive_time_ns, content_hash, rejections, reason, payload)
    select seq, map_id, kind, session_id, number, through,
        receive_time_ns, content_hash, rejections, reason, payload
    from journal order by seq;
drop table journal;
alter table journal_with_decisions rename to journal;

create index journal_by_map on journal (map_id, seq);
-- One entry begins at a number of a session: a batch is applied once, whatever is sent again.
create unique index journal_number_key on journal (session_id, number) where kind in (3, 4);
-- Decisions are few among many batches.
create index journal_decision_by_map on journal (map_id, kind, seq) where 8 <= kind;

-- Regions, graph and ids of versions, addressed by the BLAKE3 of their content: a topology that did
-- not change is stored once for all versions.
create table topologies (
    hash  blob not null,
    -- A format byte (0 plain, 1 zstd), then the content.
    bytes blob not null,
    constraint topology_hash_key primary key (hash),
    constraint topology_hash_whole check (length(hash) = 32)
) strict;

-- Null where a version has none: it was made before there were any, or is too large for one.
alter table map_versions add column topology_hash blob
    constraint map_version_topology_hash_whole
        check (topology_hash is null or length(topology_hash) = 32);

-- The next ids that no region and no arc of the map ever had, whatever is rolled back or rebuilt.
alter table maps add column next_region integer not null default 0
    constraint map_next_region_counts check (0 <= next_region);
alter table maps add column next_arc integer not null default 0
    constraint map_next_arc_counts check (0 <= next_arc);

-- Regions that a version does not have any more and the one before it had. They never come back in
-- a newer version.
create table ended_regions (
    map_id  text    not null,
    region  integer not null,
    -- The first version without it.
    version integer not null,
    -- Regions of that version that hold cells of it, most first: [[region, cells], ...].
    heirs   text    not null,
    constraint ended_region_key primary key (map_id, region),
    constraint ended_region_version_exists
        foreign key (map_id, version) references map_versions (map_id, number)
) strict, without rowid;

create index ended_region_by_version on ended_regions (map_id, version);
