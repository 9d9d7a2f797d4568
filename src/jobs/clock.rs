//! The system clock for jobs, API and commands. Algorithms and store functions take the time as an argument.

use std::time::{SystemTime, UNIX_EPOCH};

/// Returns the time in milliseconds since 1970 (UTC).
pub fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |age| i64::try_from(age.as_millis()).unwrap_or(i64::MAX))
}
