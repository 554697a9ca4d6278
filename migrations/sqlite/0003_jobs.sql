-- Why: work in the background must survive a crash of the process that does it, and a request that
-- creates something must be safe to send again.

create table jobs (
    -- Order of creation: jobs of one map are done in it.
    position             integer not null,
    id                   blob    not null,
    map_id               text    not null,
    kind                 text    not null,
    -- What was asked for, opaque here.
    params               blob    not null,
    -- 1 queued, 2 running, 3 succeeded, 4 failed, 5 cancelled.
    state                integer not null,
    -- Share done, 0 to 1.
    progress             real    not null default 0.0,
    -- The version that the job made; 0 if none.
    result_version       integer not null default 0,
    error_code           text,
    error_message        text,
    create_time_ns       integer not null,
    update_time_ns       integer not null,
    start_time_ns        integer,
    cancel_requested     integer not null default 0,
    -- Where to go on after a crash, opaque here.
    checkpoint           blob,
    -- The process that runs it, and the fence that its writes must carry.
    owner                blob,
    fence                integer not null default 0,
    lease_expire_time_ns integer not null default 0,
    constraint job_position_key primary key (position autoincrement),
    constraint job_id_key unique (id),
    constraint job_map_exists foreign key (map_id) references maps (id),
    constraint job_id_is_uuid check (length(id) = 16),
    constraint job_state_known check (state between 1 and 5),
    constraint job_progress_is_share check (progress between 0.0 and 1.0),
    constraint job_cancel_requested_is_bool check (cancel_requested in (0, 1)),
    constraint job_error_whole check (
        (error_code is null) = (state <> 4) and (error_message is null) = (state <> 4)
    )
) strict;

create index job_by_map on jobs (map_id, position);
create index job_unfinished on jobs (map_id, position) where state in (1, 2);

create table job_log (
    -- Order of writing.
    position integer not null,
    job_id   blob    not null,
    time_ns  integer not null,
    text     text    not null,
    constraint job_log_key primary key (position autoincrement),
    constraint job_log_job_exists foreign key (job_id) references jobs (id)
) strict;

create index job_log_by_job on job_log (job_id, position);

-- Replies to requests that carried an Idempotency-Key.
create table replies (
    key         text    not null,
    -- Method and path template: the same key on another route is another request.
    route       text    not null,
    -- BLAKE3 of the request: the same key with other content is a mistake of the caller.
    fingerprint blob    not null,
    status      integer not null,
    body        blob    not null,
    time_ns     integer not null,
    constraint reply_key primary key (key, route),
    constraint reply_fingerprint_whole check (length(fingerprint) = 32)
) strict;

create index reply_by_time on replies (time_ns);
