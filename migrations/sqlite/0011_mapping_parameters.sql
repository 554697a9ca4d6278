-- A version names the parameters by which its map was drawn, as it names the weights of sonar: the beginning of the
-- hash of what was decided, empty where nothing was. Deciding is an entry of kind 14 in the journal, which needs no
-- change: see 0004.
alter table map_versions add column mapping_parameters text not null default '';
