-- Why: the journal is the only truth. Maps, robots and sessions stand here because journal entries
-- name them; all that can be computed again from the journal comes with later migrations.
--
-- Times are nanoseconds since 1970. The service's own clock gives receive_time_ns and
-- create_time_ns; first_time_ns and last_time_ns are the robot's.

create table maps (
    id             text    not null,
    display_name   text    not null,
    -- Edge of a cell in metres. Fixed for ever: tiles of two sizes cannot be told apart.
    resolution_m   real    not null,
    create_time_ns integer not null,
    constraint map_id_key primary key (id),
    constraint map_resolution_positive check (0.0 < resolution_m)
) strict, without rowid;

create table robots (
    id             text    not null,
    display_name   text    not null,
    -- The newest epoch that a session was opened with; 0 before the first. Never goes back.
    epoch          integer not null,
    create_time_ns integer not null,
    constraint robot_id_key primary key (id),
    constraint robot_epoch_counts check (0 <= epoch)
) strict, without rowid;

create table sessions (
    -- Commit order of opening. Lists go by it; ids (UUIDv7) are only nearly ordered.
    position                   integer not null,
    id                         blob    not null,
    map_id                     text    not null,
    robot_id                   text    not null,
    epoch                      integer not null,
    client_key                 text    not null,
    -- 1 open, 2 closed, 3 fenced.
    state                      integer not null,
    -- The session as its robot declared it, opaque here, compared when it is opened again.
    declaration                blob    not null,
    -- The session's place in the map as it was declared: all three, or none if its start is unknown.
    -- Never changed, because the journal's entry of the opening is read from here.
    map_from_session_x_m       real,
    map_from_session_y_m       real,
    map_from_session_theta_rad real,
    -- Every batch number up to this one is in the journal, skipped ones included.
    acked_through              integer not null,
    n_scans                    integer not null,
    n_rejected                 integer not null,
    -- Smallest and largest stamp received; null before the first.
    first_time_ns              integer,
    last_time_ns               integer,
    create_time_ns             integer not null,
    -- The journal entry that closed or fenced the session.
    end_seq                    integer,
    constraint session_position_key primary key (position autoincrement),
    constraint session_id_key unique (id),
    -- A robot finds the session again by its own name for it.
    constraint session_client_key_key unique (robot_id, client_key),
    -- An epoch is one cold start, so it names one session of a robot.
    constraint session_epoch_key unique (robot_id, epoch),
    constraint session_map_exists foreign key (map_id) references maps (id),
    constraint session_robot_exists foreign key (robot_id) references robots (id),
    constraint session_id_is_uuid check (length(id) = 16),
    constraint session_state_known check (state between 1 and 3),
    constraint session_end_recorded check ((state = 1) = (end_seq is null)),
    constraint session_place_whole check (
        (map_from_session_x_m is null) = (map_from_session_y_m is null)
        and (map_from_session_x_m is null) = (map_from_session_theta_rad is null)
    )
) strict;

create index session_by_map on sessions (map_id, position);

create table journal (
    -- Commit order over all maps. Never used twice, even if entries should once be removed.
    seq             integer not null,
    map_id          text    not null,
    -- 1 map created, 2 session opened, 3 batch, 4 skip, 5 session closed, 6 session fenced,
    -- 7 version published.
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
    constraint journal_kind_known check (kind between 1 and 7),
    constraint journal_session_named check ((session_id is null) = (kind in (1, 7))),
    constraint journal_number_given check ((number is null) = (kind in (1, 2, 5, 6))),
    constraint journal_range_ordered check (
        (through is null) = (kind not in (3, 4)) and (through is null or number <= through)
    ),
    constraint journal_payload_hashed check (
        (payload is null) = (kind <> 3)
        and (content_hash is null) = (kind <> 3)
        and (content_hash is null or length(content_hash) = 32)
    ),
    constraint journal_reason_given check ((reason is null) = (kind <> 4))
) strict;

create index journal_by_map on journal (map_id, seq);

-- One entry begins at a number of a session: a batch is applied once, whatever is sent again.
create unique index journal_number_key on journal (session_id, number) where kind in (3, 4);
