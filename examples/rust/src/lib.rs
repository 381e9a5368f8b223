//! The wanderer in Rust: a core that knows no bus, the messages, and the replay of a log.

pub mod messages;
pub mod replay;
pub mod wanderer;
