-- Why: what a relax job took for the same place is to be looked at, and a person who knows better is
-- heard. Switching a closure is a decision of kind 11 in the journal, which needs no change: see 0004.

-- The ledger: what the newest relax job of each session considered, beside those that are off.
create table closures (
    -- Order of writing: session by session, by moments within one.
    position    integer not null,
    id          blob    not null,
    map_id      text    not null,
    session_id  blob    not null,
    -- Stamps of the two scans, the robot's clock in nanoseconds.
    from_ns     integer not null,
    to_ns       integer not null,
    -- The job that considered it last.
    job_id      blob    not null,
    is_accepted integer not null,
    -- All else, opaque here.
    payload     blob    not null,
    constraint closure_position_key primary key (position autoincrement),
    constraint closure_id_key unique (id),
    constraint closure_map_exists foreign key (map_id) references maps (id),
    constraint closure_session_exists foreign key (session_id) references sessions (id),
    constraint closure_job_exists foreign key (job_id) references jobs (id),
    constraint closure_id_is_uuid check (length(id) = 16),
    constraint closure_is_accepted_is_bool check (is_accepted in (0, 1))
) strict;

create index closure_by_map on closures (map_id, position);
create index closure_by_session on closures (session_id, position);

-- Closures that are switched off by what the journal decides; a row is taken away when one is switched
-- on again.
create table closures_off (
    id  blob    not null,
    -- The journal entry that switched it off.
    seq integer not null,
    constraint closure_off_key primary key (id),
    constraint closure_off_exists foreign key (id) references closures (id)
) strict, without rowid;
