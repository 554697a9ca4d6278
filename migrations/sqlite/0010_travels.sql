-- Why: topological maps are made of what robots tell of the places that they came to, few words among
-- many scans. Deciding which map is true is an entry of kind 13 in the journal, which needs no change:
-- see 0004.

-- Batches that tell of visits to places; written with the journal's entries that they are read from.
create table visit_batches (
    session_id blob    not null,
    -- The batch's number within the session.
    number     integer not null,
    constraint visit_batch_key primary key (session_id, number),
    constraint visit_batch_session_exists foreign key (session_id) references sessions (id)
) strict, without rowid;
