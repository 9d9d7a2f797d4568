//! All stable error codes, each with a one-sentence meaning and advice. The same codes appear in the API, on
//! the command line, in the database and in the documentation. A code is never renamed and never changes its
//! meaning.

macro_rules! codes {
    ($($variant:ident $name:literal $meaning:literal $advice:literal)*) => {
        /// A stable error code. [`Code::meaning`] explains it and [`Code::advice`] says what to do.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code { $(#[doc = $meaning] $variant,)* }

        impl Code {
            /// All codes, in the order of this file.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)*];

            /// Returns the stable name, in snake case.
            pub fn name(self) -> &'static str {
                match self { $(Code::$variant => $name,)* }
            }

            /// Returns the meaning, one sentence for users.
            pub fn meaning(self) -> &'static str {
                match self { $(Code::$variant => $meaning,)* }
            }

            /// Returns the advice to the user who got the error.
            pub fn advice(self) -> &'static str {
                match self { $(Code::$variant => $advice,)* }
            }

            /// Returns the code with the given name; `None` if there is none.
            pub fn from_name(name: &str) -> Option<Code> {
                match name { $($name => Some(Code::$variant),)* _ => None }
            }
        }
    };
}

codes! {
    // Input files (docs/explanation/promises.md, "Bad input").
    NotAVideo "not_a_video" "The file is not a video that can be read."
        "Send the film itself, as MP4, MOV, 3GP, MKV, WebM, AVI, MPEG, MPEG-TS, ASF, WMV, FLV, OGV, H.264 or H.265, not a \
         playlist. Pictures are measured as a zip of numbered PNG, JPEG, BMP or TIFF files, as one TIFF of several \
         pages, or, on the command line, as a folder."
    ContainerNotAllowed "container_not_allowed" "The container format is not among those accepted."
        "Convert it, for example with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4`."
    CodecNotAllowed "codec_not_allowed" "The video codec is not among those accepted."
        "Convert it, for example with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4`."
    TooManyPixels "too_many_pixels" "The picture is larger than the limit."
        "Scale it down, for example with `ffmpeg -i film -an -vf scale=1920:-2 -c:v libx264 -crf 16 smaller.mp4`."
    TooFewPixels "too_few_pixels" "The picture is smaller than the limit."
        "Film larger: each side wants at least the pixels that the sentence names."
    TooManyFrames "too_many_frames" "The footage has more frames than the limit."
        "Send a piece of it, for example with `ffmpeg -i film -an -frames:v 20000 -c:v libx264 -crf 16 piece.mp4`."
    TooManyStreams "too_many_streams" "The file holds more streams than the limit."
        "Send the film alone, for example with `ffmpeg -i film -an -sn -dn -c:v libx264 -crf 16 film-alone.mp4`."
    TooLong "too_long" "The footage lasts longer than the limit."
        "Send a piece of it, for example with `ffmpeg -i film -an -t 600 -c:v libx264 -crf 16 piece.mp4`; of a time \
         lapse all of it is measured at another rate, such as `--fps 30`."
    TooFast "too_fast" "The frame rate is above the limit."
        "Send it at fewer frames a second, for example with \
         `ffmpeg -i film -an -r 60 -c:v libx264 -crf 16 slower.mp4`, or say the true rate, such as `--fps 240`."
    Truncated "truncated" "The file is cut off or damaged inside."
        "Copy the file from the camera again. Where that is all there is, send what can be read of it, for example \
         with `ffmpeg -i film -an -c:v libx264 -crf 16 rest.mp4`."
    Encrypted "encrypted" "The video is encrypted."
        "Send it without copy protection."
    NoVideoStream "no_video_stream" "The file holds no video stream."
        "See whether the file holds more than sound."
    TooFewFrames "too_few_frames" "The footage has too few frames to analyze."
        "Film longer: half a minute or more makes a lively flock."
    TimeLimit "time_limit" "The work took longer than its time limit."
        "Try a shorter or smaller film, or fewer individuals and frames."
    MemoryLimit "memory_limit" "The work needed more memory than its limit."
        "Try a shorter or smaller film, or fewer individuals and frames."
    DecoderCrashed "decoder_crashed" "The video decoder or encoder stopped unexpectedly."
        "Convert the film with `ffmpeg -i film -an -c:v libx264 -crf 16 converted.mp4` and try again; if it comes \
         back, tell whoever runs the service."
    StorageFull "storage_full" "There is no room left to store the result."
        "Delete what is no longer needed, or ask whoever runs the service for room; then try again."
    // Analysis (docs/explanation/algorithms.md, "Refused footage").
    NothingMoves "nothing_moves" "Nothing moves before the background."
        "Film an animal that moves about, before a background that it stands out from; or give a picture of the scene \
         without it, for example with `--background empty.png`."
    NothingAtPoint "nothing_at_point" "Nothing that moves is where the animal was said to be."
        "Point at the animal in a frame in which it has moved; frames are counted from 0, as in poses.json."
    MasksDiffer "masks_differ" "The masks do not match the footage in size or number."
        "Send one mask for each frame, of the footage's own width and height. Where the footage has no constant rate, say \
         one, for example with `--fps 30`: every picture is then used once."
    MasksEmpty "masks_empty" "The masks show no animal."
        "Send masks that are white where the animal is and black elsewhere."
    BackgroundNotStatic "background_not_static" "Much of the picture changes throughout the film."
        "Put the camera on a tripod, keep zoom and focus fixed, and film before a scene that stays still. Where only a \
         part of the picture moves, leave it out, for example with `--ignore 0,0,200,100`; where only a part of the film \
         is so, measure another, for example with `--from 2 --to 20`."
    CameraMoved "camera_moved" "The camera was moved and did not stand still for long enough."
        "Measure a part in which the camera stands still, for example with `--from 2 --to 20`, or film again with the \
         camera fixed."
    LightChanges "light_changes" "The light changes too often or too much to be followed."
        "Measure a part with steady light, for example with `--from 2 --to 20`, or film in steady light; set the camera \
         to 50 or 60 Hz as the lamps need."
    SceneChanges "scene_changes" "The film shows several scenes, none of them for long enough."
        "Measure the scene with the animal alone, for example with `--from 2 --to 20`."
    AnimalTooLarge "animal_too_large" "The animal fills too much of the picture."
        "Step back, or zoom out, until the animal covers less than 15 % of the picture."
    SeveralAnimals "several_animals" "More than one animal moves in the footage."
        "Film one alone, without its mirror image; or say which one is the animal, for example with \
         `--animal-at 60:320,240` (frame, x, y), or follow the largest with `--follow-largest`."
    AnimalTooSmall "animal_too_small" "The animal is too small in the picture."
        "Film from nearer by, or with more pixels."
    BackgroundSizeDiffers "background_size_differs" "The background image has another size than the footage."
        "Send a background of the film's own width and height, or none."
    // Flocks.
    NoTransitions "no_transitions" "The library has too few moments that look alike: film longer."
        "Film longer, so that the animal comes by the same places and poses again."
    // All jobs and uploads.
    InputFailed "input_failed" "The job whose result this one needs ended without a result."
        "Look at that job's own error, mend it there, and ask again."
    CrashedWorker "crashed_worker" "The work crashed its worker twice and is not tried again."
        "Try other parameters or another film, and tell whoever runs the service."
    AlreadyStored "already_stored" "The same film is stored already."
        "Use the footage that is there: the list of all footage has it under its own id."
    InvalidParams "invalid_params" "A parameter is unknown, malformed or out of its range."
        "The sentence names what is wrong; the API's description has every range and default."
    Cancelled "cancelled" "The work was cancelled."
        "Ask again if it is wanted after all."
    // The API.
    NotFound "not_found" "There is nothing at this address."
        "Check the id: it may have been deleted, or belong to somebody else."
    NotReady "not_ready" "The result is not there yet: its job has not finished."
        "Wait for the job that the sentence names, with its events or with `Prefer: wait=60`."
    MethodNotAllowed "method_not_allowed" "The address does not take this method."
        "The answer's `Allow` header and the API's description name the methods that it takes."
    MalformedRequest "malformed_request" "The request cannot be read."
        "The sentence says where reading stopped; compare with the API's description."
    UnsupportedMediaType "unsupported_media_type" "The body is of a type that is not taken here."
        "Set `Content-Type` to what the API's description names, and send no `Content-Encoding`."
    TooLarge "too_large" "The body is larger than the limit."
        "Send less; for films the limit is the service's `--max-upload-bytes`."
    HeadTooLarge "head_too_large" "The head of the request is larger than the limit."
        "Send fewer or shorter header fields: 32 KiB together."
    AddressTooLong "address_too_long" "The address is longer than the limit."
        "Send a shorter address: 8 KiB at most."
    BodyTimeout "body_timeout" "The body came too slowly."
        "Send again over a better network, or in pieces by `/v1/uploads`."
    BodyCutOff "body_cut_off" "The body ended before it was complete."
        "Send it again; `/v1/uploads` goes on where a cut was."
    RangeNotSatisfiable "range_not_satisfiable" "The file is shorter than the range asked for."
        "`Content-Range` in the answer has the file's size."
    AlreadyFinished "already_finished" "The job has ended and cannot be cancelled."
        "Nothing needs to be done; delete its result if it is not wanted."
    IdempotencyKeyReused "idempotency_key_reused" "The Idempotency-Key was used before, with another body."
        "Make a new key for a new request."
    RequestInProgress "request_in_progress" "The request with this Idempotency-Key is still under way."
        "Wait as long as `Retry-After` says, then send the same again."
    OffsetDiffers "offset_differs" "The upload stands elsewhere: ask where, and go on from there."
        "Ask with HEAD for `Upload-Offset`, and go on from there."
    ChecksumMismatch "checksum_mismatch" "The bytes do not have the checksum that came with them."
        "Send the piece again."
    TusVersionNotSupported "tus_version_not_supported" "Tus-Resumable must be 1.0.0."
        "Send `Tus-Resumable: 1.0.0` with every request to `/v1/uploads`."
    Unauthenticated "unauthenticated" "A valid token is needed: none was given, or it is wrong, expired or revoked."
        "Send `Authorization: Bearer TOKEN`, or sign in on the page; `flockreel token create` makes tokens."
    ScopeTooSmall "scope_too_small" "The token may not do this."
        "Use a token of a larger scope: read, write, admin."
    QuotaExceeded "quota_exceeded" "There are as many jobs under way as the token may have."
        "Wait for a job to end, or cancel one."
    QueueFull "queue_full" "There are as many jobs under way as the service has room for."
        "Wait as long as `Retry-After` says, and ask again; what was uploaded is kept."
    Busy "busy" "The service has as much to do right now as there is room for."
        "Wait as long as `Retry-After` says, and send it again; of `/v1/uploads` what came is kept."
    RateLimited "rate_limited" "Too many requests in a short time: ask again soon."
        "Wait as long as `Retry-After` says; follow jobs by `/v1/events` rather than by asking often."
    CrossSite "cross_site" "Another site may not ask for this."
        "Use the service's own page under its own name, or a program that sends no `Origin`."
    Stopping "stopping" "The service is stopping: ask again soon."
        "Ask again as soon as it is up: what was accepted is kept."
    Internal "internal" "Something failed inside flockreel."
        "Try again; if it comes back, tell whoever runs the service the `x-request-id` of the answer."
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
