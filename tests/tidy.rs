//! The repository as the style asks for it.
