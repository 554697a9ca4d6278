//! Poses and what is known between them: least squares, and how sure it is.

pub(crate) mod normal_equations;
pub(crate) mod pose_graph;
pub(crate) mod uncertainty;
