//! Timestamps of the API: RFC 3339 in UTC with milliseconds for JSON, and HTTP dates for headers.

use chrono::{DateTime, SecondsFormat, Utc};

/// Returns a time such as `2026-11-21T09:30:00.000Z`. `ms` is in milliseconds since 1970.
pub(super) fn rfc3339(ms: i64) -> String {
    utc(ms).to_rfc3339_opts(SecondsFormat::Millis, true)
}

/// Returns a time such as `Sat, 21 Nov 2026 09:30:00 GMT` (RFC 9110). `ms` is in milliseconds since 1970.
pub(super) fn http_date(ms: i64) -> String {
    utc(ms).format("%a, %d %b %Y %H:%M:%S GMT").to_string()
}

/// Returns 1970 for a time that is hundreds of thousands of years away.
fn utc(ms: i64) -> DateTime<Utc> {
    DateTime::from_timestamp_millis(ms).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_follow_the_gregorian_calendar() {
        for (ms, text) in [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_400_000, "2000-02-29T00:00:00.000Z"),
            (951_868_799_999, "2000-02-29T23:59:59.999Z"),
            (1_795_253_400_123, "2026-11-21T09:30:00.123Z"),
            (4_107_542_400_000, "2100-03-01T00:00:00.000Z"),
        ] {
            assert_eq!(rfc3339(ms), text);
        }
    }

    #[test]
    fn http_date_follows_rfc_9110() {
        assert_eq!(http_date(784_111_777_000), "Sun, 06 Nov 1994 08:49:37 GMT");
    }
}
