//! What can go wrong between a robot and the service, and whether to try again.

use std::{collections::HashMap, time::Duration};

use tonic::{Code, Status};
use tonic_types::StatusExt;

/// Observations that a batch may have, by the contract.
pub(crate) const OBSERVATIONS_MAX: usize = 4096;
/// Encoded size that a batch may have, by the contract.
pub(crate) const BATCH_BYTES_MAX: usize = 1 << 20;

/// What went wrong.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The address cannot be used.
    #[error("`{url}` is not the address of a service: {reason}")]
    Url {
        /// The address as given.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The service was not reached, or the connection broke, or no answer came in time.
    #[error("service not reached: {0}")]
    Unreachable(String),
    /// The service answered, with an error.
    #[error("{0}")]
    Refused(Box<Refusal>),
    /// The service asks for a batch that it acknowledged before: it has lost data, for example by
    /// going back to an older copy of its database.
    #[error("the service expects batch {expected} but has acknowledged through {acked_through}")]
    Forgotten {
        /// The number that the service wants next.
        expected: u64,
        /// The highest number that it had acknowledged.
        acked_through: u64,
    },
    /// A batch is larger than the service takes; nothing was kept of it.
    #[error(
        "{n_observations} observations of {n_bytes} bytes; a batch takes {} of {}",
        OBSERVATIONS_MAX,
        BATCH_BYTES_MAX
    )]
    BatchTooLarge {
        /// Observations in it.
        n_observations: usize,
        /// Encoded size.
        n_bytes: usize,
    },
    /// An answer lacks what the contract promises.
    #[error("the service's answer has no `{0}`")]
    Malformed(&'static str),
    /// The robot's folder or its spool cannot be used.
    #[error("cannot use the robot's folder: {0}")]
    Folder(#[source] std::io::Error),
    /// The source of the batches failed.
    #[error("cannot read the batches to send: {0}")]
    Source(#[source] std::io::Error),
}

/// An error that the service answered with.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message} ({code})")]
pub struct Refusal {
    /// Stable, for programs: the reason of `google.rpc.ErrorInfo`, for example `SESSION_FENCED`.
    /// The gRPC code in capitals if the answer has none.
    pub code: String,
    /// For people.
    pub message: String,
    /// The gRPC code.
    pub grpc_code: Code,
    /// Facts for programs, for example `expected_number`.
    pub metadata: HashMap<String, String>,
    /// How long the service asks to be left alone.
    pub retry_after: Option<Duration>,
}

impl Error {
    /// The stable code, if the service gave the error.
    pub fn code(&self) -> Option<&str> {
        match self {
            Self::Refused(refusal) => Some(&refusal.code),
            _ => None,
        }
    }

    /// How long the service asks to be left alone before the next attempt.
    pub fn retry_after(&self) -> Option<Duration> {
        match self {
            Self::Refused(refusal) => refusal.retry_after,
            _ => None,
        }
    }

    /// True if the same request may succeed later: the service was away, busy, or broke off.
    /// A refusal for what the request says is final.
    pub fn is_retryable(&self) -> bool {
        match self {
            Self::Unreachable(_) => true,
            Self::Refused(refusal) => refusal.is_retryable(),
            _ => false,
        }
    }

    /// True if a batch number was skipped on the way; sending again from the expected one helps.
    pub fn is_gap(&self) -> bool {
        self.code() == Some("SEQUENCE_GAP")
    }
}

impl Refusal {
    fn is_retryable(&self) -> bool {
        matches!(
            self.grpc_code,
            Code::Unavailable
                | Code::DeadlineExceeded
                | Code::Aborted
                | Code::Cancelled
                | Code::ResourceExhausted
        )
    }
}

impl From<Status> for Error {
    fn from(status: Status) -> Self {
        let details = status.get_error_details();
        let Some(info) = details.error_info() else {
            return without_details(&status);
        };
        Self::Refused(Box::new(Refusal {
            code: info.reason.clone(),
            message: status.message().to_owned(),
            grpc_code: status.code(),
            metadata: info.metadata.clone(),
            retry_after: details.retry_info().and_then(|retry| retry.retry_delay),
        }))
    }
}

/// The service attaches details to all its errors: without them the transport or a proxy speaks.
/// There `UNKNOWN` and `INTERNAL` are the words for a broken connection.
fn without_details(status: &Status) -> Error {
    let transport = std::error::Error::source(status).is_some();
    match status.code() {
        Code::Unknown | Code::Unavailable => Error::Unreachable(with_causes(status)),
        Code::Internal | Code::Cancelled if transport => Error::Unreachable(with_causes(status)),
        grpc_code => Error::Refused(Box::new(Refusal {
            code: code_name(grpc_code),
            message: status.message().to_owned(),
            grpc_code,
            metadata: HashMap::new(),
            retry_after: None,
        })),
    }
}

/// The message and the chain of causes below it, each once.
fn with_causes(status: &Status) -> String {
    let mut text = status.message().to_owned();
    let mut cause = std::error::Error::source(status);
    while let Some(error) = cause {
        let line = error.to_string();
        if !text.contains(&line) {
            text = if text.is_empty() { line } else { format!("{text}: {line}") };
        }
        cause = error.source();
    }
    text
}

/// `InvalidArgument` as `INVALID_ARGUMENT`.
fn code_name(code: Code) -> String {
    let mut name = String::new();
    for letter in format!("{code:?}").chars() {
        if letter.is_ascii_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.push(letter.to_ascii_uppercase());
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic_types::ErrorDetails;

    fn refusal(code: Code, reason: &str, retry_after: Option<Duration>) -> Error {
        let mut details = ErrorDetails::new();
        details.set_error_info(reason, "meetpoint", HashMap::new());
        if let Some(delay) = retry_after {
            details.set_retry_info(Some(delay));
        }
        Status::with_error_details(code, "no", details).into()
    }

    #[test]
    fn the_stable_code_is_the_reason() {
        let fenced = refusal(Code::FailedPrecondition, "SESSION_FENCED", None);
        assert_eq!(fenced.code(), Some("SESSION_FENCED"), "{fenced}");
        assert!(!fenced.is_retryable(), "a fenced robot must not try again");
        assert_eq!(fenced.to_string(), "no (SESSION_FENCED)", "message, then code");
    }

    #[test]
    fn the_wish_of_the_service_is_read() {
        let busy = refusal(Code::ResourceExhausted, "BUSY", Some(Duration::from_secs(7)));
        assert_eq!(busy.retry_after(), Some(Duration::from_secs(7)), "{busy}");
        assert!(busy.is_retryable(), "{busy}");
    }

    #[test]
    fn what_the_request_says_is_final_and_absence_is_not() {
        for (code, retryable) in [
            (Code::Unavailable, true),
            (Code::DeadlineExceeded, true),
            (Code::Aborted, true),
            (Code::Cancelled, true),
            (Code::Unknown, true),
            (Code::InvalidArgument, false),
            (Code::NotFound, false),
            (Code::PermissionDenied, false),
            (Code::FailedPrecondition, false),
            (Code::Internal, false),
        ] {
            let error = Error::from(Status::new(code, "x"));
            assert_eq!(error.is_retryable(), retryable, "{code:?}");
        }
        let error = Error::from(Status::not_found("x"));
        assert_eq!(error.code(), Some("NOT_FOUND"), "a name even without details");
    }
}
