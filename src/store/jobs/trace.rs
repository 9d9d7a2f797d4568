//! Traces: the header `traceparent` (W3C Trace Context), by which a request and the jobs that it queues are found in
//! the logs of all services. A task-local variable holds the header, so it is no argument of the functions between
//! the request and its job.

tokio::task_local! {
    static CURRENT: Option<TraceParent>;
}

/// Length of a header of version 00, bytes: version, trace id, parent id and flags with three hyphens.
const VERSION_00_BYTES: usize = 55;

/// A valid `traceparent` of version 00: the ids of a trace and of the span of the caller, and flags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TraceParent(String);

impl TraceParent {
    /// Parses a header. Returns `None` if the header is not valid; the specification requires such a header to be
    /// ignored.
    pub fn parse(header: &str) -> Option<TraceParent> {
        let parts: Vec<&str> = header.splitn(5, '-').collect();
        let &[version, trace_id, parent_id, flags, ..] = parts.as_slice() else {
            return None;
        };
        let is_hex = |text: &str, n_digits: usize| {
            let is_digit = |byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
            text.len() == n_digits && text.bytes().all(is_digit)
        };
        let is_nonzero = |text: &str| text.bytes().any(|byte| byte != b'0');
        let is_version = match version {
            "00" => header.len() == VERSION_00_BYTES,
            "ff" => false,
            // Later versions may append parts.
            version => is_hex(version, 2),
        };
        let is_valid = is_version
            && is_hex(trace_id, 32)
            && is_hex(parent_id, 16)
            && is_hex(flags, 2)
            && is_nonzero(trace_id)
            && is_nonzero(parent_id);
        is_valid.then(|| TraceParent(format!("00-{trace_id}-{parent_id}-{flags}")))
    }

    /// Returns the header.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Returns the id of the trace, 32 hexadecimal digits.
    pub fn trace_id(&self) -> &str {
        &self.0[3..35]
    }
}

/// Runs a request. Jobs that its task queues belong to the trace.
pub async fn within<R>(trace: Option<TraceParent>, request: impl Future<Output = R>) -> R {
    CURRENT.scope(trace, request).await
}

/// Returns the trace of the request of this task.
pub(super) fn current() -> Option<TraceParent> {
    CURRENT.try_with(Clone::clone).ok().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: &str = "4bf92f3577b34da6a3ce929d0e0e4736";

    #[test]
    fn only_headers_of_the_specified_form_have_a_trace() {
        let of = |header: &str| Some(TraceParent::parse(header)?.trace_id().to_owned());
        for header in [
            format!("00-{ID}-00f067aa0ba902b7-01"),
            format!("cc-{ID}-00f067aa0ba902b7-01"),
            format!("cc-{ID}-00f067aa0ba902b7-01-what-the-future-will-be-like"),
        ] {
            assert_eq!(of(&header).as_deref(), Some(ID), "{header}");
        }
        for header in [
            String::new(),
            format!("00-{ID}-00f067aa0ba902b7-01-"),
            format!("00-{ID}-00f067aa0ba902b7"),
            format!("00-{ID}-00f067aa0ba902b7-0g"),
            format!("ff-{ID}-00f067aa0ba902b7-01"),
            format!("0-{ID}-00f067aa0ba902b7-01"),
            format!("00-{}-00f067aa0ba902b7-01", ID.to_uppercase()),
            format!("00-{}-00f067aa0ba902b7-01", "0".repeat(32)),
            format!("00-{ID}-{}-01", "0".repeat(16)),
            format!("00-{}é-00f067aa0ba902b7-01", &ID[..30]),
            "-".repeat(55),
        ] {
            assert_eq!(of(&header), None, "{header}");
        }
    }

    #[tokio::test]
    async fn trace_belongs_to_the_task_of_its_request() {
        let trace = TraceParent::parse(&format!("00-{ID}-00f067aa0ba902b7-01"));
        assert!(trace.is_some());
        assert_eq!(current(), None);
        let inside = within(trace.clone(), async { current() }).await;
        assert_eq!(inside, trace);
        assert_eq!(current(), None);
    }
}
