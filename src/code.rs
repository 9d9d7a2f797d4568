//! Every stable error code: its name, and one line of meaning. The same in the API, on the command
//! line, in the database and in the docs. A code is never renamed and never means something else.

macro_rules! codes {
    ($($variant:ident $name:literal $meaning:literal)*) => {
        /// A stable reason; see [`Code::meaning`] for each one's sense.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code { $(#[doc = $meaning] $variant,)* }

        impl Code {
            /// Every code, in the order of this file.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// The stable name, in snake case.
            pub fn name(self) -> &'static str {
                match self { $(Code::$variant => $name,)* }
            }

            /// What it means, one sentence for people.
            pub fn meaning(self) -> &'static str {
                match self { $(Code::$variant => $meaning,)* }
            }

            /// The code of a name, if there is one.
            pub fn from_name(name: &str) -> Option<Code> {
                match name { $($name => Some(Code::$variant),)* _ => None }
            }
        }
    };
}

codes! {
    // The file (RELIABILITY.md, the gate).
    NotAVideo "not_a_video" "The file is not a video that can be read."
    ContainerNotAllowed "container_not_allowed" "The container format is not among those accepted."
    CodecNotAllowed "codec_not_allowed" "The video codec is not among those accepted."
    TooManyPixels "too_many_pixels" "The picture is larger than the limit."
    TooFewPixels "too_few_pixels" "The picture is smaller than the limit."
    TooManyFrames "too_many_frames" "The footage has more frames than the limit."
    TooManyStreams "too_many_streams" "The file holds more streams than the limit."
    TooLong "too_long" "The footage lasts longer than the limit."
    TooFast "too_fast" "The frame rate is above the limit."
    Truncated "truncated" "The file is cut off or damaged inside."
    Encrypted "encrypted" "The video is encrypted."
    NoVideoStream "no_video_stream" "The file holds no video stream."
    TooFewFrames "too_few_frames" "The footage has too few frames to analyze."
    TimeLimit "time_limit" "The work took longer than its time limit."
    MemoryLimit "memory_limit" "The work needed more memory than its limit."
    DecoderCrashed "decoder_crashed" "The video decoder or encoder stopped unexpectedly."
    StorageFull "storage_full" "There is no room left to store the result."
    // The analysis (ALGORITHMS.md 2.9).
    NothingMoves "nothing_moves" "Nothing moves before the background."
    BackgroundNotStatic "background_not_static" "The background moves: the camera must stand still."
    SeveralAnimals "several_animals" "More than one animal moves in the footage."
    AnimalTooSmall "animal_too_small" "The animal is too small in the picture."
    BackgroundSizeDiffers "background_size_differs" "The background image has another size than the footage."
    // The flock.
    NoTransitions "no_transitions" "The library has too few moments that look alike: film longer."
    // Anything.
    InputFailed "input_failed" "The job whose result this one needs ended without a result."
    CrashedWorker "crashed_worker" "The work crashed its worker twice and is not tried again."
    InvalidParams "invalid_params" "A parameter is unknown, malformed or out of its range."
    Cancelled "cancelled" "The work was cancelled."
    // The door.
    NotFound "not_found" "There is nothing at this address."
    NotReady "not_ready" "The result is not there yet: its job has not finished."
    MethodNotAllowed "method_not_allowed" "The address does not take this method."
    MalformedRequest "malformed_request" "The request cannot be read."
    UnsupportedMediaType "unsupported_media_type" "The body is of a type that is not taken here."
    TooLarge "too_large" "The body is larger than the limit."
    HeadTooLarge "head_too_large" "The head of the request is larger than the limit."
    AddressTooLong "address_too_long" "The address is longer than the limit."
    BodyTimeout "body_timeout" "The body came too slowly."
    BodyCutOff "body_cut_off" "The body ended before it was complete."
    RangeNotSatisfiable "range_not_satisfiable" "The file is shorter than the range asked for."
    AlreadyFinished "already_finished" "The job has ended and cannot be cancelled."
    IdempotencyKeyReused "idempotency_key_reused" "The Idempotency-Key was used before, with another body."
    RequestInProgress "request_in_progress" "The request with this Idempotency-Key is still under way."
    OffsetDiffers "offset_differs" "The upload stands elsewhere: ask where, and go on from there."
    ChecksumMismatch "checksum_mismatch" "The bytes do not have the checksum that came with them."
    TusVersionNotSupported "tus_version_not_supported" "Tus-Resumable must be 1.0.0."
    Unauthenticated "unauthenticated" "A valid token is needed: none was given, or it is wrong, expired or revoked."
    ScopeTooSmall "scope_too_small" "The token may not do this."
    QuotaExceeded "quota_exceeded" "There are as many jobs under way as the token may have."
    RateLimited "rate_limited" "Too many requests in a short time: ask again soon."
    CrossSite "cross_site" "Another site may not ask for this."
    Stopping "stopping" "The service is stopping: ask again soon."
    Internal "internal" "Something failed inside flockreel."
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_leads_back_to_its_code() {
        for &code in Code::ALL {
            assert_eq!(Code::from_name(code.name()), Some(code));
        }
    }
}
