-- Why: sessions of a map are relaxed together, so that a closure may join moments of two of them. What
-- was considered before joins two moments of one. A constraint is gained: both tables are copied.

create table closures_between_sessions (
    -- Order of writing: job by job, by moments within one.
    position        integer not null,
    id              blob    not null,
    map_id          text    not null,
    -- Whose the earlier moment is, or that of the session that was relaxed before the other...
    from_session_id blob    not null,
    -- ...and the stamp of its scan, that robot's clock in nanoseconds.
    from_ns         integer not null,
    -- The same of the later moment.
    to_session_id   blob    not null,
    to_ns           integer not null,
    -- The job that considered it last.
    job_id          blob    not null,
    is_accepted     integer not null,
    -- All else, opaque here.
    payload         blob    not null,
    constraint closure_position_key primary key (position autoincrement),
    constraint closure_id_key unique (id),
    constraint closure_map_exists foreign key (map_id) references maps (id),
    constraint closure_from_session_exists foreign key (from_session_id) references sessions (id),
    constraint closure_to_session_exists foreign key (to_session_id) references sessions (id),
    constraint closure_job_exists foreign key (job_id) references jobs (id),
    constraint closure_id_is_uuid check (length(id) = 16),
    constraint closure_is_accepted_is_bool check (is_accepted in (0, 1))
) strict;

insert into closures_between_sessions (position, id, map_id, from_session_id, from_ns,
        to_session_id, to_ns, job_id, is_accepted, payload)
    select position, id, map_id, session_id, from_ns, session_id, to_ns, job_id, is_accepted, payload
    from closures order by position;

create table closures_off_between_sessions (
    id  blob    not null,
    -- The journal entry that switched it off.
    seq integer not null,
    constraint closure_off_key primary key (id),
    constraint closure_off_exists foreign key (id) references closures_between_sessions (id)
) strict, without rowid;

insert into closures_off_between_sessions (id, seq) select id, seq from closures_off;

drop table closures_off;
drop table closures;
-- References follow the name.
alter table closures_between_sessions rename to closures;
alter table closures_off_between_sessions rename to closures_off;

create index closure_by_map on closures (map_id, position);
create index closure_by_from_session on closures (from_session_id, position);
create index closure_by_to_session on closures (to_session_id, position);
