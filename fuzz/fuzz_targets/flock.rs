//! Entry point of libFuzzer. The name of this program is that of its target (fuzz/src/targets/mod.rs).
#![no_main]

use flockreel_fuzz::targets::{limit_memory, run};

libfuzzer_sys::fuzz_target!(init: limit_memory(), |bytes: &[u8]| run(env!("CARGO_BIN_NAME"), bytes));
