-- Why: which weights read the sonars is a setting that can be changed, and a version tells by which it was
-- drawn.

alter table map_versions add column
    -- Names the weights in force when the version was made; empty if it was made before this was noted.
    sonar_weights text not null default '';
