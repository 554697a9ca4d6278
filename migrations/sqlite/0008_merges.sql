-- Why: sessions of unknown start get a place in the map when there is evidence of it, which is told as a
-- merge and decided by a rule or a person. Deciding is an entry of kind 12 in the journal, which needs no
-- change: see 0004.

-- One a session: what the newest merge job found of its place, and what was decided about it.
create table merges (
    -- In the order of being looked at first.
    position      integer not null,
    id            blob    not null,
    map_id        text    not null,
    session_id    blob    not null,
    -- 1 open, 2 accepted, 3 rejected, 4 undone.
    state         integer not null,
    -- The journal entry that decided the state; null while it is open.
    seq           integer,
    -- The job that looked at it last.
    job_id        blob    not null,
    -- Poses that the session had then, and scans that the map had drawn, by which it is known when to
    -- look again.
    n_poses       integer not null,
    n_scans_drawn integer not null,
    -- What was found, opaque here.
    payload       blob    not null,
    -- What was decided, opaque here; null while it is open.
    decision      blob,
    constraint merge_position_key primary key (position autoincrement),
    constraint merge_id_key unique (id),
    constraint merge_session_key unique (session_id),
    constraint merge_map_exists foreign key (map_id) references maps (id),
    constraint merge_session_exists foreign key (session_id) references sessions (id),
    constraint merge_job_exists foreign key (job_id) references jobs (id),
    constraint merge_id_is_uuid check (length(id) = 16),
    constraint merge_state_known check (state between 1 and 4),
    constraint merge_decision_recorded check (
        (state = 1) = (seq is null) and (state = 1) = (decision is null)
    ),
    constraint merge_counts check (0 <= n_poses and 0 <= n_scans_drawn)
) strict;

create index merge_by_map on merges (map_id, position);

-- Where merges in force put sessions; those that are not here are where they declared to be, or in a
-- frame of their own. Made of the journal's decisions.
create table placements (
    session_id blob not null,
    -- The session in whose frame it lies; null for the map's.
    frame_id   blob,
    -- The session's own frame seen from there.
    x_m        real not null,
    y_m        real not null,
    theta_rad  real not null,
    constraint placement_key primary key (session_id),
    constraint placement_session_exists foreign key (session_id) references sessions (id),
    constraint placement_frame_exists foreign key (frame_id) references sessions (id)
) strict, without rowid;

-- Sessions beside where merges put them: all null where none does.
create view placed_sessions as
    select sessions.*, placements.session_id is not null as is_merged, placements.frame_id,
        placements.x_m, placements.y_m, placements.theta_rad
    from sessions left join placements on placements.session_id = sessions.id;
