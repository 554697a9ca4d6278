//! Errors of the store as errors of operations, and these as gRPC's.

use meetpoint_storage as storage;

use super::{Error, status};

impl From<storage::Error> for Error {
    fn from(error: storage::Error) -> Self {
        use storage::Error as Stored;
        match error {
            Stored::SessionKeyTaken { .. } => Self::SessionKeyTaken,
            Stored::SessionFenced { newest } => Self::SessionFenced { newest: Some(newest) },
            Stored::SessionClosed(_) => Self::SessionClosed,
            Stored::MapNotEmpty(map) => Self::MapNotEmpty(map.0),
            Stored::OtherResolution { .. } => Self::field("yaml.resolution", error.to_string()),
            Stored::EpochTooLarge { .. } => Self::field("epoch", error.to_string()),
            Stored::Full => Self::StorageFull,
            Stored::Busy | Stored::MergesChanged(_) => Self::StorageBusy,
            Stored::Damaged(what) => {
                tracing::error!(what, "the database is damaged");
                Self::StorageDamaged
            }
            other => Self::internal(other),
        }
    }
}

impl From<Error> for tonic::Status {
    fn from(error: Error) -> Self {
        use tonic_types::{ErrorDetails, StatusExt};
        error.log();
        let mut details = ErrorDetails::new();
        let metadata: std::collections::HashMap<String, String> =
            error.metadata().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        details.set_error_info(error.reason(), "meetpoint", metadata);
        if let Some(delay) = error.retry_after() {
            details.set_retry_info(Some(delay));
        }
        if let Error::InvalidField { field, problem } = &error {
            details.add_bad_request_violation(field, problem);
        }
        Self::with_error_details(status(error.code()).1, error.to_string(), details)
    }
}
