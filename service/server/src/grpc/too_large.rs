//! A message above the size limit is refused by the transport, before any handler: this gives that
//! refusal its stable code.

use axum::response::Response;
use tonic::Status;

use crate::error::Error;

/// What the transport says of a message that it does not decode.
const TOO_LARGE: &str = "decoded message length too large";

/// The response with our error in place of the transport's.
pub(super) fn named(response: Response, limit_bytes: usize) -> Response {
    match Status::from_header_map(response.headers()) {
        Some(refusal) => match mended(&refusal, limit_bytes) {
            Some(status) => status.into_http(),
            None => response,
        },
        None => response,
    }
}

/// Our error, if the transport refused a message for its size.
pub(super) fn mended(refusal: &Status, limit_bytes: usize) -> Option<Status> {
    let message = refusal.message();
    if !message.contains(TOO_LARGE) {
        return None;
    }
    let n_bytes = message
        .split(|c: char| !c.is_ascii_digit())
        .find_map(|digits| digits.parse().ok())
        .unwrap_or(limit_bytes);
    Some(Error::MessageTooLarge { n_bytes, limit_bytes }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic_types::StatusExt;

    #[test]
    fn has_a_stable_code() {
        let refusal = Status::out_of_range(
            "Error, decoded message length too large: found 104857600 bytes, the limit is: 4194304 bytes",
        );
        let status = mended(&refusal, 4_194_304).expect("it is one");
        assert_eq!(
            status.get_details_error_info().map(|info| info.reason),
            Some("MESSAGE_TOO_LARGE".to_owned()),
            "named"
        );
        assert!(status.message().contains("104857600"), "the size is told");
        assert!(mended(&Status::out_of_range("batch 7 is expected"), 1).is_none(), "ours stays");
    }
}
