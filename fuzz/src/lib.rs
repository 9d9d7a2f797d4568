//! The entry points of libFuzzer share this library. `tests/it/fuzz.rs` compiles the same targets.

pub mod targets;
