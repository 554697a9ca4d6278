//! The service as seen from outside: the real binary on a free port, asked over gRPC and REST.
//!
//! A scenario that both protocols can tell is written once against [`door::Door`] and run over
//! both. Nothing here is timed: what takes a while is looked at until it is there.

mod change_json;
mod changes;
mod closure_json;
mod door;
mod drive;
mod exploration_json;
mod four_rooms;
mod from_json;
mod graph_json;
mod grpc_door;
mod http;
mod hypothesis_json;
mod job_json;
mod kept;
mod landmark_loop;
mod merge_json;
mod merge_worlds;
mod parameters_json;
mod place_door;
mod place_json;
mod plan_json;
mod rest_answer;
mod rest_door;
mod running;
mod to_json;

mod closed_door;
mod contract;
mod costs;
mod crash;
mod doors;
mod exploring;
mod graphs;
mod grid_landmarks;
mod growing;
mod hypotheses;
mod imports;
mod interrupted_jobs;
mod laser_relaxing;
mod loop_closing;
mod maps;
mod merging;
mod merging_by_person;
mod merging_interrupted;
mod merging_landmarks;
mod merging_live;
mod merging_tagged;
mod mrclam;
mod operation;
mod parameters;
mod places;
mod plans;
mod rejections;
mod relaxing;
mod replay;
mod sessions;
mod sonar;
mod sonar_weights;
mod storage_faults;
mod stream;
mod tag_camera;
mod tagged_hall;
mod watching;
