//! What a caller can do about an error, and the one table of status codes.

use axum::http::StatusCode;

/// What a caller can do about an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Mend the request.
    Invalid,
    /// Ask for something that is there.
    NotFound,
    /// Take another name.
    AlreadyExists,
    /// Another request won.
    Conflict,
    /// Send what is missing first.
    SequenceGap,
    /// Not in this state.
    WrongState,
    /// Send less.
    TooLarge,
    /// Try again later; an operator has to make room.
    Full,
    /// Try again soon.
    Busy,
    /// The operator has to look.
    Damaged,
    /// Not the caller's fault.
    Internal,
}

/// The only table of status codes.
#[must_use]
pub fn status(code: Code) -> (StatusCode, tonic::Code) {
    match code {
        Code::Invalid => (StatusCode::BAD_REQUEST, tonic::Code::InvalidArgument),
        Code::NotFound => (StatusCode::NOT_FOUND, tonic::Code::NotFound),
        Code::AlreadyExists => (StatusCode::CONFLICT, tonic::Code::AlreadyExists),
        Code::Conflict => (StatusCode::UNPROCESSABLE_ENTITY, tonic::Code::Aborted),
        Code::SequenceGap => (StatusCode::CONFLICT, tonic::Code::OutOfRange),
        Code::WrongState => (StatusCode::CONFLICT, tonic::Code::FailedPrecondition),
        Code::TooLarge => (StatusCode::PAYLOAD_TOO_LARGE, tonic::Code::InvalidArgument),
        Code::Full => (StatusCode::INSUFFICIENT_STORAGE, tonic::Code::ResourceExhausted),
        Code::Busy => (StatusCode::SERVICE_UNAVAILABLE, tonic::Code::Unavailable),
        Code::Damaged => (StatusCode::INTERNAL_SERVER_ERROR, tonic::Code::DataLoss),
        Code::Internal => (StatusCode::INTERNAL_SERVER_ERROR, tonic::Code::Internal),
    }
}
